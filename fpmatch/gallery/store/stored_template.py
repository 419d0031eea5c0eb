"""Stored templates: one template in about 2,700 bytes, as galleries keep it.

All numbers are little-endian; bits are packed from the highest of a byte on, each column of
numbers beginning with a byte of its own::

    "fm" and the version; 1 where there is a ridge field and 2 where it shows the ridges
    dpi in thousandths; width, height; number of minutiae; least x and y; bits of an x and of a y
    columns of the minutiae: x and y above the least, angle (8 bits), kind (2), quality (7)
    of a ridge field: step; rows, columns; first row and column of the box around its mask, and the
    box's rows and columns; the mask inside the box, a bit a cell; the orientation of the cells
    inside the mask (4 bits), in row order; the binary images of their ridges (64 bits)
    CRC-32 of all before

Positions are whole pixels at 500 dpi, which is exactly where `fpmatch.image.extract` finds
minutiae; angles are 256ths of a turn, ridge orientations 16ths of a half turn. Kinds, qualities
and mask are exact.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.templates.bounds import (
    ANGLE_BITS,
    DPI_UNITS,
    LEAST_UNIQUE,
    MOST_CELLS,
    check_bounds,
    rounded_dpi,
    rounded_minutiae,
)
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

FIELD, RIDGES = 1, 2  # what there is beside the minutiae
MAGIC: Final = b"fm"
VERSION: Final = 2
UNSTATED_VERSION: Final = 3  # the same of a print whose resolution nothing states
KNOWN: Final = {1: FIELD, VERSION: RIDGES, UNSTATED_VERSION: RIDGES}
"""The greatest content of each version that is read; version 1 has no ridges."""
HEAD: Final = struct.Struct("<2sBB")
MINUTIAE_HEAD: Final = struct.Struct("<IHHHhhBB")
FIELD_HEAD: Final = struct.Struct("<fHHHHHH")
CRC: Final = struct.Struct("<I")
WIDTHS: Final = (ANGLE_BITS, 2, 7)  # bits of an angle, a kind and a quality
ORIENTATION_BITS: Final = 4
MOST_BITS: Final = 16  # of a number
ANGLES: Final = (np.arange(2**ANGLE_BITS) * (2 * np.pi / 2**ANGLE_BITS)).astype(np.float32)
STEPS: Final = (np.arange(2**ORIENTATION_BITS) * (np.pi / 2**ORIENTATION_BITS)).astype(np.float32)


def pack_template(template: Template) -> bytes:
    """Return a template in few bytes; an unpacked one gives the same bytes again.

    Raises TemplateError if a number is outside the bounds of `fpmatch.templates.bounds`: minutiae
    are within 32,767 pixels of the origin at 500 dpi, at most 65,535 of them, and a ridge field has
    at most a million cells.

    Examples
    --------
    >>> template = Template(Minutiae(x=[10, 20], y=[5, 8], angle=[0, 1.6]), width=300, height=400)
    >>> data = pack_template(template)
    >>> len(data), unpack_template(data).minutiae.xy.tolist()
    (31, [[10.0, 5.0], [20.0, 8.0]])
    """
    check_bounds(template)
    field = template.field
    content = 0 if field is None else FIELD if field.ridges is None else RIDGES
    version = VERSION if template.dpi_known else UNSTATED_VERSION
    whole = HEAD.pack(MAGIC, version, content) + _pack_minutiae(template)
    if field is not None:
        whole += _pack_field(field, STANDARD_DPI / (rounded_dpi(template) / DPI_UNITS))
    return whole + CRC.pack(zlib.crc32(whole))


def minutiae_digest(template: Template) -> bytes:
    """Return a hash of the frame and the minutiae of a template as they would be packed.

    It is b"" for a template that cannot be packed, or of so few minutiae that others may be equal.
    """
    try:
        check_bounds(template)
    except TemplateError:
        return b""
    return _digest(_pack_minutiae(template)) if len(template) >= LEAST_UNIQUE else b""


def stored_minutiae_digest(data: bytes) -> bytes:
    """Return the `minutiae_digest` of a stored template that was checked."""
    _, _, _, count, _, _, *bits = MINUTIAE_HEAD.unpack_from(data, HEAD.size)
    end = HEAD.size + MINUTIAE_HEAD.size + sum(_column_bytes(count, (*bits, *WIDTHS)))
    return _digest(data[HEAD.size : end]) if count >= LEAST_UNIQUE else b""


def _digest(packed_minutiae: bytes) -> bytes:
    return hashlib.blake2b(packed_minutiae, digest_size=16).digest()


def unpack_template(data: bytes) -> Template:
    """Return the template that `pack_template` packed, its numbers rounded once.

    Raises TemplateError if `data` is of another version, damaged, or no stored template at all.
    """
    check_packed(data)
    try:
        template = _unpack(data[: -CRC.size])
        check_bounds(template)
    except (ValueError, struct.error, FpmatchError) as error:
        raise TemplateError(f"packed template is damaged: {error}") from error
    return template


def check_packed(data: bytes) -> None:
    """Check the version and the checksum of a stored template.

    Raises TemplateError as `unpack_template`, which finds damage from before packing too.
    """
    if data[:2] != MAGIC or len(data) < HEAD.size + MINUTIAE_HEAD.size + CRC.size:
        raise TemplateError("not a packed template")
    if data[2] not in KNOWN:
        raise TemplateError(f"packed template of version {data[2]} (known: up to {max(KNOWN)})")
    if CRC.unpack(data[-CRC.size :])[0] != zlib.crc32(memoryview(data)[: -CRC.size]):
        raise TemplateError("packed template is damaged")


def is_unstated(data: bytes) -> bool:
    """Return whether nothing states the resolution of a stored template that was checked."""
    return data[2] == UNSTATED_VERSION


def _unpack(data: bytes) -> Template:
    _, version, content = HEAD.unpack_from(data)
    if content > KNOWN[version]:
        raise TemplateError("it contains unknown data")
    dpi_units, width, height, count, *least, bits_x, bits_y = MINUTIAE_HEAD.unpack_from(
        data, HEAD.size
    )
    if max(bits_x, bits_y) > MOST_BITS:
        raise TemplateError("its positions have too many bits")
    columns, at = _read_columns(
        data, HEAD.size + MINUTIAE_HEAD.size, count, (bits_x, bits_y, *WIDTHS)
    )
    dpi = dpi_units / DPI_UNITS
    zoom = STANDARD_DPI / dpi if dpi else 1.0
    xy = ((columns[:2] + np.array(least)[:, None] + 0.5) / zoom - 0.5).astype(np.float32)
    kind, quality = columns[3:].astype(np.uint8)
    minutiae = Minutiae(xy[0], xy[1], ANGLES[columns[2]], kind, quality)
    field = None
    if content:
        field, at = _unpack_field(data, at, zoom, ridged=content == RIDGES)
    if at != len(data):
        raise TemplateError("it has too many bytes")
    return Template(minutiae, width, height, dpi, field, dpi_known=version != UNSTATED_VERSION)


def _pack_minutiae(template: Template) -> bytes:
    """Return resolution, frame and minutiae packed."""
    columns = rounded_minutiae(template)
    count = columns.shape[1]
    least = columns[:2].min(axis=1) if count else np.zeros(2, np.int64)
    columns[:2] -= least[:, None]
    bits = [most.bit_length() for most in columns[:2].max(axis=1, initial=0).tolist()]
    size = template.width, template.height
    head = MINUTIAE_HEAD.pack(rounded_dpi(template), *size, count, *least.tolist(), *bits)
    return head + _packed_columns(columns, (*bits, *WIDTHS))


def _column_bytes(count: int, widths: Sequence[int]) -> list[int]:
    """Return the bytes of columns of numbers of so many bits."""
    return [(count * width + 7) // 8 for width in widths]


def _packed_columns(columns: NDArray[np.int64], widths: Sequence[int]) -> bytes:
    """Return each column of numbers in so many bits a number, the highest first."""
    table = np.unpackbits(columns.astype(">u2")[..., None].view(np.uint8), axis=2)
    packed = [
        np.packbits(bits[:, MOST_BITS - width :]).tobytes()
        for bits, width in zip(table, widths, strict=True)
    ]
    return b"".join(packed)


def _read_columns(
    data: bytes, at: int, count: int, widths: Sequence[int]
) -> tuple[NDArray[np.int64], int]:
    """Return the numbers that `_packed_columns` packed, and where they end."""
    sizes = _column_bytes(count, widths)
    bits = np.unpackbits(np.frombuffer(data, np.uint8, sum(sizes), at))
    table = np.zeros((len(widths), count, MOST_BITS), np.uint8)
    begin = 0
    for column, width, size in zip(table, widths, sizes, strict=True):
        column[:, MOST_BITS - width :] = bits[begin : begin + count * width].reshape(count, width)
        begin += 8 * size
    return np.packbits(table, axis=2).view(">u2")[..., 0].astype(np.int64), at + sum(sizes)


def _pack_field(field: RidgeField, zoom: float) -> bytes:
    mask = field.mask
    inside = mask.ravel().nonzero()[0]
    top = bottom = left = right = 0
    if len(inside):
        rows, columns = inside // mask.shape[1], inside % mask.shape[1]
        top, bottom = rows[0], rows[-1] + 1
        left, right = columns.min(), columns.max() + 1
    head = FIELD_HEAD.pack(field.step * zoom, *mask.shape, top, left, bottom - top, right - left)
    box = np.packbits(mask[top:bottom, left:right]).tobytes()
    steps = np.rint(field.orientation.ravel()[inside] * (2**ORIENTATION_BITS / np.pi))
    steps = steps.astype(np.int64) % 2**ORIENTATION_BITS
    words = b"" if field.ridges is None else field.ridges.ravel()[inside].astype(">u8").tobytes()
    return head + box + _packed_columns(steps[None], (ORIENTATION_BITS,)) + words


def _unpack_field(data: bytes, at: int, zoom: float, *, ridged: bool) -> tuple[RidgeField, int]:
    """Return a ridge field, with ridges where they follow, and where it ends."""
    step, rows, columns, top, left, height, width = FIELD_HEAD.unpack_from(data, at)
    at += FIELD_HEAD.size
    if rows * columns > MOST_CELLS or top + height > rows or left + width > columns:
        raise TemplateError("its ridge field leaves its frame")
    cells = height * width
    box = np.unpackbits(np.frombuffer(data, np.uint8, (cells + 7) // 8, at), count=cells)
    at += (cells + 7) // 8
    mask = np.zeros((rows, columns), bool)
    mask[top : top + height, left : left + width] = box.reshape(height, width)
    inside = int(np.count_nonzero(mask))
    (steps,), at = _read_columns(data, at, inside, (ORIENTATION_BITS,))
    orientation = np.zeros((rows, columns), np.float32)
    orientation[mask] = STEPS[steps]
    ridges = None
    if ridged:
        ridges = np.zeros(mask.shape, np.uint64)
        ridges[mask] = np.frombuffer(data, ">u8", inside, at)
        at += ridges.itemsize * inside
    return RidgeField(step / zoom, orientation, mask, ridges), at

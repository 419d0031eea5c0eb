"""Stored templates: one template in about 2,700 bytes, as galleries keep it.

All numbers are little-endian; bits are packed from the highest of a byte on, each column of
numbers beginning with a byte of its own::

    "fm" and the version, 1 where there is a ridge field and 2 where it shows
    the ridges; dpi in thousandths; width, height; number of minutiae; least x and y; bits of an x
    and of a y
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

from fpmatch.base.binary_records import ByteReader
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
    from numpy.typing import NDArray

FIELD, RIDGES = 1, 2  # what there is beside the minutiae
KIND_BITS: Final = 2
QUALITY_BITS: Final = 7
ORIENTATION_BITS: Final = 4
HEAD: Final = struct.Struct("<2sBBIHHHhhBB")
MINUTIAE_HEAD: Final = struct.Struct("<IHHHhhBB")  # the last of it
FIELD_HEAD: Final = struct.Struct("<fHHHHHH")
CRC: Final = struct.Struct("<I")
MOST_BITS: Final = 32  # of a position that is read; none that was packed has more than 16
ANGLES: Final = (np.arange(2**ANGLE_BITS) * (2 * np.pi / 2**ANGLE_BITS)).astype(np.float32)
STEPS: Final = (np.arange(2**ORIENTATION_BITS) * (np.pi / 2**ORIENTATION_BITS)).astype(np.float32)
_POWERS: Final = 1 << np.arange(MOST_BITS)[::-1]


MAGIC: Final = b"fm"
VERSION: Final = 2
UNSTATED_VERSION: Final = 3  # the same of a print whose resolution nothing states
KNOWN: Final = {1: FIELD, VERSION: RIDGES, UNSTATED_VERSION: RIDGES}
"""The greatest content of each version that is read; version 1 has no ridges."""
CELL_BYTES: Final = 8  # of the binary image of the ridges in a cell


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
    content = 0 if template.field is None else FIELD if template.field.ridges is None else RIDGES
    zoom = STANDARD_DPI / (rounded_dpi(template) / DPI_UNITS)
    try:
        minutiae = _pack_minutiae(template)
        field = b"" if template.field is None else _pack_field(template.field, zoom)
    except (struct.error, OverflowError) as error:
        raise TemplateError("template too large to be kept in a gallery") from error
    version = VERSION if template.dpi_known else UNSTATED_VERSION
    whole = MAGIC + bytes((version, content)) + minutiae + field
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
    *_, count, _, _, bits_x, bits_y = HEAD.unpack(data[: HEAD.size])
    begin, end = HEAD.size - MINUTIAE_HEAD.size, HEAD.size + body_bytes(count, bits_x, bits_y)
    return _digest(data[begin:end]) if count >= LEAST_UNIQUE else b""


def _digest(packed_minutiae: bytes) -> bytes:
    return hashlib.blake2b(packed_minutiae, digest_size=16).digest()


def unpack_template(data: bytes) -> Template:
    """Return the template that `pack_template` packed, its numbers rounded once.

    Raises TemplateError if `data` is of another version, damaged, or no stored template at all.
    """
    check_packed(data)
    try:
        template = _unpack(ByteReader(data[: -CRC.size], TemplateError))
        check_bounds(template)
    except (ValueError, struct.error, FpmatchError) as error:
        raise TemplateError(f"packed template is damaged: {error}") from error
    return template


def check_packed(data: bytes) -> tuple[int, float]:
    """Check the checksum of a stored template; return its number of minutiae and its dpi.

    Raises TemplateError as `unpack_template`, which finds damage from before packing too.
    """
    if data[:2] != MAGIC or len(data) < HEAD.size + CRC.size:
        raise TemplateError("not a packed template")
    if data[2] not in KNOWN:
        raise TemplateError(f"packed template of version {data[2]} (known: up to {max(KNOWN)})")
    if CRC.unpack(data[-CRC.size :])[0] != zlib.crc32(memoryview(data)[: -CRC.size]):
        raise TemplateError("packed template is damaged")
    _, _, _, dpi_units, _, _, count, *_ = HEAD.unpack(data[: HEAD.size])
    return count, dpi_units / DPI_UNITS


def is_unstated(data: bytes) -> bool:
    """Return whether nothing states the resolution of a stored template that was checked."""
    return data[2] == UNSTATED_VERSION


def body_bytes(count: int, bits_x: int, bits_y: int) -> int:
    """Return the bytes of the columns of the minutiae of a template."""
    widths = (bits_x, bits_y, ANGLE_BITS, KIND_BITS, QUALITY_BITS)
    return sum((count * width + 7) // 8 for width in widths)


def _unpack(reader: ByteReader) -> Template:
    head = HEAD.unpack(reader.take(HEAD.size))
    _, version, content, dpi_units, width, height, count, least_x, least_y, bits_x, bits_y = head
    if content > KNOWN[version]:
        raise TemplateError("it contains unknown data")
    if max(bits_x, bits_y) > MOST_BITS:
        raise TemplateError("its positions have too many bits")
    dpi = dpi_units / DPI_UNITS
    zoom = STANDARD_DPI / dpi if dpi else 1.0
    columns = []
    for bits in (bits_x, bits_y, ANGLE_BITS, KIND_BITS, QUALITY_BITS):
        columns.append(_read_column(reader, count, bits))
    xy = [
        ((column + least + 0.5) / zoom - 0.5).astype(np.float32)
        for column, least in zip(columns, (least_x, least_y), strict=False)
    ]
    kind, quality = (column.astype(np.uint8) for column in columns[3:])
    minutiae = Minutiae(xy[0], xy[1], ANGLES[columns[2]], kind, quality)
    field = _unpack_field(reader, zoom, ridged=content == RIDGES) if content else None
    if reader.left:
        raise TemplateError("it has too many bytes")
    return Template(minutiae, width, height, dpi, field, dpi_known=not is_unstated(reader.data))


def _pack_minutiae(template: Template) -> bytes:
    """Return resolution, frame and minutiae packed."""
    columns = rounded_minutiae(template)
    count = columns.shape[1]
    least = np.minimum.reduce(columns[:2], axis=1) if count else np.zeros(2, np.int64)
    columns[:2] -= least[:, None]
    bits = [int(np.maximum.reduce(column, initial=0)).bit_length() for column in columns[:2]]
    size = template.width, template.height
    head = MINUTIAE_HEAD.pack(rounded_dpi(template), *size, count, *least.tolist(), *bits)
    widths = (*bits, ANGLE_BITS, KIND_BITS, QUALITY_BITS)
    return head + b"".join(map(_packed_column, columns, widths))


def _packed_column(column: NDArray[np.int64], bits: int) -> bytes:
    """Return numbers from 0 on in so many bits each, the highest first."""
    return np.packbits(column[:, None] >> np.arange(bits)[::-1] & 1).tobytes()


def _read_column(reader: ByteReader, count: int, bits: int) -> NDArray[np.int64]:
    """Return the numbers that `_packed_column` packed."""
    data = np.frombuffer(reader.take((count * bits + 7) // 8), np.uint8)
    return (
        np.unpackbits(data, count=count * bits).reshape(count, bits) @ _POWERS[MOST_BITS - bits :]
    )


def _pack_field(field: RidgeField, zoom: float) -> bytes:
    mask = field.mask
    rows, columns = (np.logical_or.reduce(mask, axis=axis).nonzero()[0].tolist() for axis in (1, 0))
    inside = mask.ravel().nonzero()[0]
    top, bottom = (rows[0], rows[-1] + 1) if rows else (0, 0)
    left, right = (columns[0], columns[-1] + 1) if columns else (0, 0)
    head = FIELD_HEAD.pack(field.step * zoom, *mask.shape, top, left, bottom - top, right - left)
    steps = np.rint(field.orientation.ravel()[inside] * (2**ORIENTATION_BITS / np.pi))
    coded = np.zeros(len(steps) + len(steps) % 2, np.uint8)
    coded[: len(steps)] = steps.astype(np.int64) % 2**ORIENTATION_BITS
    orientation = coded[::2] << ORIENTATION_BITS | coded[1::2]
    words = field.ridges
    ridges = b"" if words is None else words.ravel()[inside].astype(">u8").tobytes()
    box = np.packbits(mask[top:bottom, left:right])
    return head + box.tobytes() + orientation.tobytes() + ridges


def _unpack_field(reader: ByteReader, zoom: float, *, ridged: bool) -> RidgeField:
    """Return a ridge field, with ridges where they follow."""
    step, rows, columns, top, left, height, width = FIELD_HEAD.unpack(reader.take(FIELD_HEAD.size))
    if rows * columns > MOST_CELLS or top + height > rows or left + width > columns:
        raise TemplateError("its ridge field leaves its frame")
    cells = height * width
    box = np.frombuffer(reader.take((cells + 7) // 8), np.uint8)
    mask = np.zeros((rows, columns), bool)
    mask[top : top + height, left : left + width] = np.unpackbits(box, count=cells).reshape(
        height, width
    )
    inside = int(np.count_nonzero(mask))
    coded = np.frombuffer(reader.take((inside + 1) // 2), np.uint8)
    steps = np.column_stack((coded >> ORIENTATION_BITS, coded & (2**ORIENTATION_BITS - 1)))
    orientation = np.zeros((rows, columns), np.float32)
    orientation[mask] = STEPS[steps.ravel()[:inside]]
    ridges = None
    if ridged:
        ridges = np.zeros(mask.shape, np.uint64)
        ridges[mask] = np.frombuffer(reader.take(CELL_BYTES * inside), ">u8")
    return RidgeField(step / zoom, orientation, mask, ridges)

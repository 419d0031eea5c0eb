"""Packed templates, as galleries keep them: about 2,500 bytes with the ridges.

All numbers are little-endian; bits are packed from the highest of a byte on, each column of
numbers beginning with a byte of its own::

    "fm", version, 1 where there is a ridge field and 2 where it shows the ridges; dpi in
    thousandths; width, height; number of minutiae; least x and y; bits of an x and of a y
    columns of the minutiae: x and y above the least, angle (8 bits), kind (2), quality (7)
    of a ridge field: step; rows, columns; first row and column of the box around its mask, and the
    box's rows and columns; the mask inside the box, a bit a cell; the orientation of the cells
    inside the mask (4 bits), in row order; their pictures of the ridges (64 bits), the highest
    bit first
    CRC-32 of all before

Positions are whole pixels at 500 dpi, which is exactly where `fpmatch.image.extract` finds
minutiae; angles are 256ths of a turn, ridge orientations 16ths of a half turn. Kinds, qualities,
mask and ridges are exact.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.binary_records import ByteReader
from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.bounds import MOST_CELLS, MOST_PX, check_bounds
from fpmatch.minutiae import STANDARD_DPI, Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Ints = NDArray[np.int64]

VERSION: Final = 2
FIELD, RIDGES = 1, 2  # what there is beside the minutiae
KNOWN: Final = {1: FIELD, VERSION: RIDGES}  # version 1 is the same without ridges
ANGLE_BITS: Final = 8
KIND_BITS: Final = 2
QUALITY_BITS: Final = 7
ORIENTATION_BITS: Final = 4
_MAGIC: Final = b"fm"
_HEAD: Final = struct.Struct("<2sBBIHHHhhBB")
_FIELD: Final = struct.Struct("<fHHHHHH")
_CRC: Final = struct.Struct("<I")
_DPI_UNITS: Final = 1000


def pack_template(template: Template) -> bytes:
    """Return a template in few bytes; an unpacked template gives the same bytes again.

    Raises TemplateError if a number is outside the bounds of `fpmatch.formats.bounds`: minutiae
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
    m = template.minutiae
    dpi_units = round(template.dpi * _DPI_UNITS)
    zoom = STANDARD_DPI / (dpi_units / _DPI_UNITS)
    x, y = _at_500_dpi(m.x, zoom), _at_500_dpi(m.y, zoom)
    least = [int(values.min(initial=MOST_PX)) if len(m) else 0 for values in (x, y)]
    above = [values - start for values, start in zip((x, y), least, strict=True)]
    bits = [int(values.max(initial=0)).bit_length() for values in above]
    angle = np.rint(m.angle * (2**ANGLE_BITS / (2 * np.pi))).astype(np.int64) % 2**ANGLE_BITS
    content = 0 if template.field is None else FIELD if template.field.ridges is None else RIDGES
    try:
        head = _HEAD.pack(
            *(_MAGIC, VERSION, content, dpi_units),
            *(template.width, template.height, len(m), *least, *bits),
        )
        field = b"" if template.field is None else _pack_field(template.field, zoom)
    except (struct.error, OverflowError) as error:
        raise TemplateError("template too large to be kept in a gallery") from error
    columns = (*above, angle, m.kind, m.quality)
    widths = (*bits, ANGLE_BITS, KIND_BITS, QUALITY_BITS)
    body = b"".join(_to_bits(*column) for column in zip(columns, widths, strict=True))
    whole = head + body + field
    return whole + _CRC.pack(zlib.crc32(whole))


def unpack_template(data: bytes) -> Template:
    """Return the template that `pack_template` packed, its numbers rounded once.

    Raises TemplateError if `data` is of another version, damaged, or no packed template at all.
    """
    check_packed(data)
    try:
        template = _unpack(ByteReader(data[: -_CRC.size], TemplateError))
        check_bounds(template)
    except (ValueError, struct.error, FpmatchError) as error:
        raise TemplateError(f"packed template is damaged: {error}") from error
    return template


def check_packed(data: bytes) -> tuple[int, float]:
    """Check the checksum of a packed template; return its number of minutiae and its dpi.

    Raises TemplateError as `unpack_template`, which finds damage that was there before packing too.
    """
    if data[:2] != _MAGIC or len(data) < _HEAD.size + _CRC.size:
        raise TemplateError("not a packed template")
    if data[2] not in KNOWN:
        raise TemplateError(f"packed template of version {data[2]} (known: up to {VERSION})")
    if _CRC.unpack(data[-_CRC.size :])[0] != zlib.crc32(memoryview(data)[: -_CRC.size]):
        raise TemplateError("packed template is damaged")
    _, _, _, dpi_units, _, _, count, *_ = _HEAD.unpack(data[: _HEAD.size])
    return count, dpi_units / _DPI_UNITS


def _column(reader: ByteReader, count: int, width: int) -> Ints:
    """Read `count` numbers of `width` bits each."""
    octets = np.frombuffer(reader.take(-(-count * width // 8)), np.uint8)
    bits = np.unpackbits(octets, count=count * width).reshape(count, width)
    return bits @ (1 << np.arange(width - 1, -1, -1, dtype=np.int64))


def _unpack(reader: ByteReader) -> Template:
    head = _HEAD.unpack(reader.take(_HEAD.size))
    _, version, content, dpi_units, width, height, count, least_x, least_y, bits_x, bits_y = head
    if content > KNOWN[version]:
        raise TemplateError("it contains unknown data")
    dpi = dpi_units / _DPI_UNITS
    zoom = STANDARD_DPI / dpi if dpi else 1.0
    widths = (bits_x, bits_y, ANGLE_BITS, KIND_BITS, QUALITY_BITS)
    x, y, angle, kind, quality = (_column(reader, count, width) for width in widths)
    minutiae = Minutiae(
        x=((x + least_x + 0.5) / zoom - 0.5).astype(np.float32),
        y=((y + least_y + 0.5) / zoom - 0.5).astype(np.float32),
        angle=(angle * (2 * np.pi / 2**ANGLE_BITS)).astype(np.float32),
        kind=kind.astype(np.uint8),
        quality=quality.astype(np.uint8),
    )
    field = _unpack_field(reader, zoom, ridged=content == RIDGES) if content else None
    if reader.left:
        raise TemplateError("it has too many bytes")
    return Template(minutiae, width, height, dpi, field)


def _at_500_dpi(values: NDArray[np.float32], zoom: float) -> Ints:
    """Return pixel positions of the image as whole pixels at 500 dpi; pixel centres stay such."""
    return np.rint((values.astype(np.float64) + 0.5) * zoom - 0.5).astype(np.int64)


def _pack_field(field: RidgeField, zoom: float) -> bytes:
    rows, columns = (np.flatnonzero(field.mask.any(axis=axis)) for axis in (1, 0))
    top, height = (int(rows[0]), int(np.ptp(rows)) + 1) if len(rows) else (0, 0)
    left, width = (int(columns[0]), int(np.ptp(columns)) + 1) if len(columns) else (0, 0)
    head = _FIELD.pack(field.step * zoom, *field.mask.shape, top, left, height, width)
    steps = np.rint(field.orientation[field.mask] * (2**ORIENTATION_BITS / np.pi))
    orientation = steps.astype(np.int64) % 2**ORIENTATION_BITS
    box = field.mask[top : top + height, left : left + width]
    ridges = b"" if field.ridges is None else field.ridges[field.mask].astype(">u8").tobytes()
    return head + np.packbits(box).tobytes() + _to_bits(orientation, ORIENTATION_BITS) + ridges


def _unpack_field(reader: ByteReader, zoom: float, *, ridged: bool) -> RidgeField:
    step, rows, columns, top, left, height, width = _FIELD.unpack(reader.take(_FIELD.size))
    if rows * columns > MOST_CELLS or top + height > rows or left + width > columns:
        raise TemplateError("its ridge field leaves its frame")
    mask = np.zeros((rows, columns), bool)
    box = _column(reader, height * width, 1).astype(bool).reshape(height, width)
    mask[top : top + height, left : left + width] = box
    orientation = np.zeros((rows, columns), np.float32)
    steps = _column(reader, int(np.count_nonzero(mask)), ORIENTATION_BITS)
    orientation[mask] = steps * (np.pi / 2**ORIENTATION_BITS)
    ridges = None
    if ridged:
        ridges = np.zeros((rows, columns), np.uint64)
        ridges[mask] = np.frombuffer(reader.take(8 * len(steps)), ">u8")
    return RidgeField(step / zoom, orientation, mask, ridges)


def _to_bits(values: NDArray[Any], width: int) -> bytes:
    """Return numbers from 0 on, each in `width` bits, as bytes."""
    places = np.arange(width - 1, -1, -1)
    bits = (values.astype(np.int64)[:, None] >> places) & 1
    return np.packbits(bits.astype(np.uint8)).tobytes()

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
from typing import Final

import numpy as np

from fpmatch.binary_records import ByteReader
from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.bounds import MOST_CELLS, check_bounds
from fpmatch.gallery._compact_kernel import at_500_dpi, read_columns, to_image, write_columns
from fpmatch.minutiae import STANDARD_DPI, Minutiae, RidgeField, Template

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
MOST_BITS: Final = 32  # of a position that is read; none that was packed has more than 16
_ANGLES: Final = (np.arange(2**ANGLE_BITS) * (2 * np.pi / 2**ANGLE_BITS)).astype(np.float32)
_STEPS: Final = (np.arange(2**ORIENTATION_BITS) * (np.pi / 2**ORIENTATION_BITS)).astype(np.float32)
_ORIENTATIONS: Final = np.stack([np.repeat(_STEPS, len(_STEPS)), np.tile(_STEPS, len(_STEPS))], 1)
"""The two orientations in each byte."""


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
    columns = np.empty((5, len(m)), np.int64)
    least = [at_500_dpi(values, zoom, columns[k]) for k, values in enumerate((m.x, m.y))]
    bits = [int(column.max(initial=0)).bit_length() for column in columns[:2]]
    columns[2] = np.rint(m.angle * (2**ANGLE_BITS / (2 * np.pi)))
    columns[2] %= 2**ANGLE_BITS
    columns[3], columns[4] = m.kind, m.quality
    content = 0 if template.field is None else FIELD if template.field.ridges is None else RIDGES
    try:
        head = _HEAD.pack(
            *(_MAGIC, VERSION, content, dpi_units),
            *(template.width, template.height, len(m), *least, *bits),
        )
        field = b"" if template.field is None else _pack_field(template.field, zoom)
    except (struct.error, OverflowError) as error:
        raise TemplateError("template too large to be kept in a gallery") from error
    widths = np.array((*bits, ANGLE_BITS, KIND_BITS, QUALITY_BITS), np.int64)
    body = np.zeros(_body_bytes(len(m), *bits), np.uint8)
    write_columns(columns, widths, body)
    whole = head + body.tobytes() + field
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


def _body_bytes(count: int, bits_x: int, bits_y: int) -> int:
    """Return the bytes of the columns of the minutiae."""
    widths = (bits_x, bits_y, ANGLE_BITS, KIND_BITS, QUALITY_BITS)
    return sum((count * width + 7) // 8 for width in widths)


def _unpack(reader: ByteReader) -> Template:
    head = _HEAD.unpack(reader.take(_HEAD.size))
    _, version, content, dpi_units, width, height, count, least_x, least_y, bits_x, bits_y = head
    if content > KNOWN[version]:
        raise TemplateError("it contains unknown data")
    if max(bits_x, bits_y) > MOST_BITS:
        raise TemplateError("its positions have too many bits")
    dpi = dpi_units / _DPI_UNITS
    zoom = STANDARD_DPI / dpi if dpi else 1.0
    columns = np.empty((5, count), np.int64)
    widths = np.array((bits_x, bits_y, ANGLE_BITS, KIND_BITS, QUALITY_BITS), np.int64)
    body = np.frombuffer(reader.take(_body_bytes(count, bits_x, bits_y)), np.uint8)
    read_columns(body, widths, columns)
    xy = np.empty((2, count), np.float32)
    for column, least, values in zip(columns, (least_x, least_y), xy, strict=False):
        to_image(column, least, zoom, values)
    kind, quality = columns[3:].astype(np.uint8)
    minutiae = Minutiae(xy[0], xy[1], _ANGLES[columns[2]], kind, quality)
    field = _unpack_field(reader, zoom, ridged=content == RIDGES) if content else None
    if reader.left:
        raise TemplateError("it has too many bytes")
    return Template(minutiae, width, height, dpi, field)


def _pack_field(field: RidgeField, zoom: float) -> bytes:
    mask = field.mask
    rows, columns = (np.flatnonzero(mask.any(axis=axis)).tolist() for axis in (1, 0))
    top, bottom = (rows[0], rows[-1] + 1) if rows else (0, 0)
    left, right = (columns[0], columns[-1] + 1) if columns else (0, 0)
    head = _FIELD.pack(field.step * zoom, *mask.shape, top, left, bottom - top, right - left)
    steps = np.rint(field.orientation[mask] * (2**ORIENTATION_BITS / np.pi))
    coded = np.zeros(len(steps) + len(steps) % 2, np.uint8)
    coded[: len(steps)] = steps.astype(np.int64) % 2**ORIENTATION_BITS
    orientation = coded[::2] << ORIENTATION_BITS | coded[1::2]
    ridges = b"" if field.ridges is None else field.ridges[mask].astype(">u8").tobytes()
    box = np.packbits(mask[top:bottom, left:right])
    return head + box.tobytes() + orientation.tobytes() + ridges


def _unpack_field(reader: ByteReader, zoom: float, *, ridged: bool) -> RidgeField:
    step, rows, columns, top, left, height, width = _FIELD.unpack(reader.take(_FIELD.size))
    if rows * columns > MOST_CELLS or top + height > rows or left + width > columns:
        raise TemplateError("its ridge field leaves its frame")
    cells = height * width
    octets = np.frombuffer(reader.take((cells + 7) // 8), np.uint8)
    mask = np.zeros((rows, columns), bool)
    box = np.unpackbits(octets, count=cells).view(bool).reshape(height, width)
    mask[top : top + height, left : left + width] = box
    inside = int(np.count_nonzero(box))
    pairs = np.frombuffer(reader.take((inside * ORIENTATION_BITS + 7) // 8), np.uint8)
    orientation = np.zeros((rows, columns), np.float32)
    orientation[mask] = _ORIENTATIONS[pairs].reshape(-1)[:inside]
    ridges = None
    if ridged:
        ridges = np.zeros((rows, columns), np.uint64)
        ridges[mask] = np.frombuffer(reader.take(8 * inside), ">u8")
    return RidgeField(step / zoom, orientation, mask, ridges)

"""ANSI/NIST-ITL files (AN2, EFT, EBTS; traditional encoding): images, and minutiae of type 9.

The first record lists the others, by type and number (IDC). Records of types 3 to 8 are binary and
begin with their length in four bytes; the others are fields ``9.012:value`` separated by GS, of
subfields separated by RS, of items separated by US, and end with FS.

A record of type 9 may hold minutiae in several blocks of fields; the first of these is read:

- 9.126 to 9.150, ANSI/INCITS 378 ("M1"): pixels from the top left, units of two degrees;
- 9.300 to 9.399, the extended feature set: 0.01 mm from the top left of a region, degrees;
- 9.013 to 9.030, FBI IAFIS: 0.01 mm from the top left, degrees;
- 9.005 to 9.012, the standard block: 0.01 mm from the bottom left, degrees in the direction
  opposite to that of ISO/IEC 19794-2.

Size and resolution come from the block, or the image record of the same number, or, the resolution
only, the first record. Ridge counts, cores and deltas are ignored. Minutiae are only read.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from math import isnan, nan
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.errors import FpmatchError, ImageReadError, TemplateError
from fpmatch.formats.record import (
    ReadingOptions,
    TemplateRecord,
    View,
    check_minutiae,
    check_views,
    span,
)
from fpmatch.image.io.grey import dpi_in_units, usable_dpi
from fpmatch.image.io.read import UNCOMPRESSED, StoredImage, decode_stored
from fpmatch.printable import count
from fpmatch.templates.minutiae import LARGEST, MM_PER_INCH, Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage, ImageLimits

FS, GS, RS, US = b"\x1c", b"\x1d", b"\x1e", b"\x1f"
IMAGE_FIELD: Final = 999  # the last field of a text record; its image may contain separators
_WITHOUT_IMAGE: Final = frozenset({1, 2, 9})  # text records without an image, whatever the field
BINARY_TYPES: Final = frozenset(range(3, 9))
GREY_FINGER: Final = 4  # the binary type of a print of 8 bits
HEADER_BYTES: Final = 18  # of that type
PRINT_TYPES: Final = (GREY_FINGER, 13, 14, 15)  # of text: latent, finger, palm
MAX_RECORDS: Final = 2000
MAX_FIELDS: Final = 1000  # of one record
_START: Final = re.compile(rb"1\.0?01:(\d{1,9})\x1d")
_RECORD_START: Final = re.compile(rb"(\d{1,2})\.0?01:(\d{1,9})\x1d")
_TAG: Final = re.compile(rb"(\d{1,2})\.(\d{2,4}):")
_COMPRESSION: Final = (UNCOMPRESSED, "WSQ20", "JPEGB", "JPEGL", "JP2", "JP2L", "PNG")  # of type 4
_STANDARD_PPI: Final = 500.0
NO_PRINT: Final = "has no print in it (amputated or unprinted)"
MINUTIAE_TYPE: Final = 9
IMAGE_FRAME, M1_FRAME = 6, 128  # the first of the fields of width, height, unit and resolution
REGION: Final = 300  # of the extended feature set: width, height and offsets, then its polygon
UNITS_PER_INCH: Final = 2540  # of 0.01 mm
WORST_QUALITY: Final = 63  # of the scale on which 2 is best, 1 unknown, and 0 set by hand
BEST_QUALITY: Final = 2
_ABSENT: Final = (b"",) * 6  # items that the last of a minutia may lack
KINDS: Final = {
    **dict.fromkeys((b"A", b"E", b"1"), MinutiaKind.ENDING),
    **dict.fromkeys((b"B", b"2"), MinutiaKind.BIFURCATION),
}


class Record(NamedTuple):
    """One record: type (1 to 99), number (equal in records of one print) and bytes."""

    type: int
    idc: int
    data: bytes

    def fields(self) -> dict[int, bytes]:
        """Return the fields of a text record by number."""
        by_number: dict[int, bytes] = {}
        at = 0
        for _ in range(MAX_FIELDS):
            tag = _TAG.match(self.data, at)
            number = int(tag[2]) if tag else 0
            if tag and number >= IMAGE_FIELD and self.type not in _WITHOUT_IMAGE:
                by_number[number] = self.data[tag.end() : -1]
                break
            end = self.data.find(GS, at)
            if tag:
                value = self.data[tag.end() :] if end < 0 else self.data[tag.end() : end]
                by_number.setdefault(number, value.rstrip(FS))
            if end < 0:
                break
            at = end + 1
        return by_number

    def has_image(self) -> bool:
        """Return whether the record of a print has one, not that of a missing finger."""
        if self.type == GREY_FINGER:
            return len(self.data) > HEADER_BYTES
        return bool(self.fields().get(IMAGE_FIELD))


def table(value: bytes) -> list[list[bytes]]:
    """Return the items of the subfields of a field."""
    return [subfield.split(US) for subfield in value.split(RS)]


def contents(data: bytes, error: Callable[[str], FpmatchError]) -> list[tuple[int, int]]:
    """Return type and number of each record after the first, which may be all of `data`."""
    listed = Record(1, 0, data[: data.find(FS) + 1] or data).fields().get(3)
    if listed is None:
        raise error("the first record does not list the others (field 1.003)")
    if listed.count(RS) > MAX_RECORDS:
        raise error(f"more than {MAX_RECORDS} records")
    others = []
    for items in table(listed)[1:]:
        if len(items) < 2 or not all(item.isdigit() and len(item) < 4 for item in items[:2]):
            raise error("the list of records (field 1.003) is malformed")
        others.append((int(items[0]), int(items[1])))
    return others


def types_of(data: bytes) -> set[int]:
    """Return the types of the records that a file lists, none if it is not ANSI/NIST-ITL."""
    try:
        return {kind for kind, _ in contents(data, ImageReadError)} if _START.match(data) else set()
    except FpmatchError:
        return set()


def holds_image(data: bytes) -> bool:
    """Return whether a file lists a record of a print."""
    return not types_of(data).isdisjoint(PRINT_TYPES)


def read_records(data: bytes, error: Callable[[str], FpmatchError]) -> list[Record]:
    """Return all records of a file; raises what `error` makes of the reason if it is damaged."""
    start = _START.match(data)
    if start is None:
        raise error("it does not begin with a record of type 1")
    reader = ByteReader(data, error)
    records = [Record(1, 0, reader.take(int(start[1])))]
    for kind, idc in contents(data, error):
        if kind in BINARY_TYPES:
            length = int.from_bytes(data[reader.at : reader.at + 4], "big")
        else:
            start = _RECORD_START.match(data, reader.at)
            if start is None or int(start[1]) != kind:
                raise error(f"no record of type {kind} at byte {reader.at}, where one is listed")
            length = int(start[2])
        if length < 1:
            raise error(f"the record of type {kind} at byte {reader.at} declares no length")
        records.append(Record(kind, idc, reader.take(length)))
    return records


def native_dpi(first: Record) -> float | None:
    """Return the scanning resolution in the first record, stored in pixels per millimetre."""
    try:
        return usable_dpi(round(float(first.fields().get(11, b"")) * MM_PER_INCH))
    except (ValueError, OverflowError):
        return None


def decode_image(data: bytes, limits: ImageLimits, number: int | None = None) -> GreyImage:
    """Decode image `number` of a file, from 1, as 8-bit grey values; by default the first.

    Records without an image, of fingers that are amputated or bandaged, are passed over. Raises
    ImageReadError if there is no such image, or it is damaged.
    """
    first, *others = records = read_records(data, _damaged)
    prints = [record for record in others if record.type in PRINT_TYPES]
    if not prints:
        types = ", ".join(str(record.type) for record in records)
        raise ImageReadError(f"ANSI/NIST file without a grey print (its records: type {types})")
    with_image = [record for record in prints if record.has_image()]
    if not with_image:
        raise ImageReadError(f"ANSI/NIST file that {NO_PRINT}")
    if number is not None and number > len(with_image):
        raise ImageReadError(f"ANSI/NIST file of {len(with_image)} images, not {number}")
    record = with_image[(number or 1) - 1]
    stored = _binary_image(record, first) if record.type == GREY_FINGER else _tagged_image(record)
    image = decode_stored(stored, f"ANSI/NIST type {record.type}", limits)
    if number is not None or len(with_image) == 1:
        return image
    several = f"the first of its {len(with_image)} images was read (--record chooses one)"
    return replace(image, notes=(*image.notes, several))


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged ANSI/NIST file ({reason})")


def _binary_image(record: Record, first: Record) -> StoredImage:
    body = ByteReader(record.data, _damaged)
    body.take(12)  # length, identifier, impression type, finger positions
    is_native, width, height, compression = body.numbers("B2HB")
    if compression >= len(_COMPRESSION):
        raise ImageReadError(f"ANSI/NIST file with an unknown compression ({compression})")
    dpi = native_dpi(first) if is_native else _STANDARD_PPI
    pixels = body.take(body.left)
    return StoredImage(pixels, _COMPRESSION[compression], width, height, 1, dpi or 0, dpi or 0)


def _tagged_image(record: Record) -> StoredImage:
    fields = record.fields()
    width, height, units, across, down = (_whole(fields.get(n, b"0")) for n in range(6, 11))
    name = fields.get(11, b"NONE").decode("latin-1").strip().upper()
    depth = _whole(fields.get(12, b"8"))
    across, down = across or down, down or across
    return StoredImage(fields[IMAGE_FIELD], name, width, height, units, across, down, depth)


def _whole(text: bytes) -> int:
    digits = text.strip()
    if not digits.isdigit() or len(digits) > 12:
        raise _damaged("text where a number should be")
    return int(digits)


_Row = tuple[float, float, float, int, float]
"""A minutia: x, y in the unit of its block, ISO angle in degrees or NaN, kind, quality or NaN."""


class _Block(NamedTuple):
    """A block of fields: its name, the field of the finger, how the items of a minutia are read."""

    name: str
    finger: int
    row: Callable[[list[bytes]], _Row]
    y_up: bool = False
    pixels: bool = False


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in the records of type 9, or raise TemplateError."""
    first, *others = read_records(data, TemplateError)
    images = {r.idc: r for r in reversed(others) if r.type in PRINT_TYPES}
    views, notes = list[View](), list[str]()
    for record in others:
        if record.type != MINUTIAE_TYPE:
            continue
        fields = record.fields()
        number = next((number for number in _BLOCKS if number in fields), None)
        if number is None:
            notes.append(f"a record of type 9 (IDC {record.idc}) without minutiae passed over")
            continue
        is_m1 = _BLOCKS[number].pixels
        size, dpi = _frame(record, M1_FRAME) if is_m1 else _frame(images.get(record.idc))
        views.append(_view(fields, number, size, dpi or native_dpi(first), options, notes))
        check_views(len(views))
    if not views:
        raise TemplateError("no minutiae in the file (no record of type 9 that has some)")
    return TemplateRecord("an2", tuple(views), tuple(notes))


def _view(
    fields: dict[int, bytes],
    number: int,
    known_size: tuple[int, int] | None,
    known_dpi: float | None,
    options: ReadingOptions,
    notes: list[str],
) -> View:
    """Return the minutiae in the block of a field, in a frame whose parts may be unknown."""
    block = _BLOCKS[number]
    dpi = known_dpi or options.dpi
    scale = 1.0 if block.pixels else dpi / UNITS_PER_INCH
    check_minutiae(fields[number].count(RS) + 1)
    try:
        all_rows = [block.row([*items, *_ABSENT]) for items in table(fields[number])]
    except (IndexError, ValueError) as error:
        raise TemplateError(f"field 9.{number:03d} is malformed") from error
    rows = [row for row in all_rows if not isnan(row[2])]
    if undirected := len(all_rows) - len(rows):
        notes.append(f"{count(undirected, 'minutia', 'minutiae')} without a direction passed over")
    columns: Any = np.array(rows, np.float64).reshape(-1, 5).T
    x, y, degrees, kind, quality = columns
    if REGION in fields and block.name == EFS:
        width, height, left, top = _region(fields[REGION])
        x, y = x + left, y + top
        if known_size is None and width > 0 and height > 0:
            known_size = round((left + width) * scale), round((top + height) * scale)
    x, y, size = x * scale, y * scale, known_size or options.size
    if block.y_up:
        y = (size[1] if size else np.ceil(y.max(initial=1.0))) - y
    known = ~np.isnan(quality)
    minutiae = Minutiae(x, y, np.radians(degrees), kind, np.where(known, quality, 100.0))
    width, height = size or span(minutiae.x, minutiae.y)
    return View(
        Template(minutiae, width, height, dpi, dpi_known=known_dpi is not None),
        finger=_code(fields, block.finger),
        impression=_code(fields, 3),
        size_known=known_size is not None,
        quality_known=bool(known.any()) or not rows,
        fields=(("minutiae of", block.name),),
    )


def _region(field: bytes) -> list[float]:
    """Return width, height and offsets of the region of an extended feature set, 0 if unknown."""
    try:
        items = [*table(field)[0], *_ABSENT][:4]
        return [_decimal(item) if item.strip() else 0.0 for item in items]
    except ValueError as error:
        raise TemplateError(f"field 9.{REGION} is malformed") from error


def _m1(items: list[bytes]) -> _Row:
    x, y, angle, quality = (_decimal(items[k]) for k in (1, 2, 3, 5))
    known = min(100.0, quality) if quality > 0 else nan
    return x, y, angle * 2.0, KINDS.get(items[4], MinutiaKind.OTHER), known


def _efs(items: list[bytes]) -> _Row:
    degrees = _decimal(items[2]) if items[2].strip() else nan
    kind = KINDS.get(items[3], MinutiaKind.OTHER)
    return _decimal(items[0]), _decimal(items[1]), degrees, kind, nan


def _packed(items: list[bytes], turn: float) -> _Row:
    """Return the minutia of items XXXXYYYYTTT, quality and kind, rotated by `turn` degrees."""
    x, y, degrees = (_decimal(items[1][part]) for part in (slice(4), slice(4, 8), slice(8, 11)))
    quality = nan
    if items[2].strip() and (grade := _decimal(items[2])) >= BEST_QUALITY:
        quality = 100 * max(0.0, WORST_QUALITY - grade) / (WORST_QUALITY - BEST_QUALITY)
    return x, y, degrees + turn, KINDS.get(items[3], MinutiaKind.OTHER), quality


EFS: Final = "extended feature set"
_BLOCKS: Final = {  # by the field of the minutiae; the first that a record has is read
    137: _Block("ANSI/INCITS 378 block", 134, _m1, pixels=True),
    331: _Block(EFS, 302, _efs),
    23: _Block("FBI IAFIS block", 14, partial(_packed, turn=0.0)),
    12: _Block("standard block", 6, partial(_packed, turn=180.0), y_up=True),
}


def _frame(
    record: Record | None, first: int = IMAGE_FRAME
) -> tuple[tuple[int, int] | None, float | None]:
    """Return size and resolution in a record, by its fields from a `first` on, None if unknown."""
    width = height = unit = pixels = 0
    if record is not None and record.type == GREY_FINGER:
        width, height = (int.from_bytes(record.data[k : k + 2], "big") for k in (13, 15))
    elif record is not None:
        fields = record.fields()
        width, height, unit, pixels = (_code(fields, first + k) for k in range(4))
    return (width, height) if width and height else None, dpi_in_units(unit, pixels)


def _decimal(value: bytes) -> float:
    """Return a number written as text, or raise ValueError."""
    number = float(value)
    if not abs(number) <= LARGEST:
        raise ValueError("not finite")
    return number


def _code(fields: dict[int, bytes], number: int) -> int:
    """Return the whole number in the first item of a field, 0 if there is none."""
    first = table(fields.get(number, b""))[0][0].strip()
    return int(first) if first.isdigit() and len(first) < 7 else 0


def holds_minutiae(data: bytes) -> bool:
    """Return whether a file lists a record of minutiae."""
    return MINUTIAE_TYPE in types_of(data)

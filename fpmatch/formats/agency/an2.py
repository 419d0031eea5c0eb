"""ANSI/NIST-ITL files (AN2, EFT, EBTS; traditional encoding): their records and images.

The first record lists the others, by type and number (IDC). Records of types 3 to 8 are binary and
begin with their length in four bytes; the others are fields ``9.012:value`` separated by GS, of
subfields separated by RS, of items separated by US, and end with FS.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.base.binary_records import ByteReader
from fpmatch.errors import FpmatchError, ImageReadError
from fpmatch.image.io.records import UNCOMPRESSED, StoredImage, decode_stored
from fpmatch.image.io.resolution import usable_dpi
from fpmatch.templates.minutiae import MM_PER_INCH

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage, ImageLimits
    from fpmatch.image.io.records import DecodeFile

FS, GS, RS, US = b"\x1c", b"\x1d", b"\x1e", b"\x1f"
IMAGE_FIELD: Final = 999  # the last field of a text record; its image may contain separators
_WITHOUT_IMAGE: Final = frozenset({1, 2, 9})  # text records without an image, whatever the field
BINARY_TYPES: Final = frozenset(range(3, 9))
GREY_FINGER: Final = 4  # the binary type of a print of 8 bits
PRINT_TYPES: Final = (GREY_FINGER, 13, 14, 15)  # of text: latent, finger, palm
MAX_RECORDS: Final = 2000
MAX_FIELDS: Final = 1000  # of one record
_START: Final = re.compile(rb"1\.0?01:(\d{1,9})\x1d")
_RECORD_START: Final = re.compile(rb"(\d{1,2})\.0?01:(\d{1,9})\x1d")
_IMAGE_AGAIN: Final = re.compile(rb"\d{1,2}\.999:")
_TAG: Final = re.compile(rb"(\d{1,2})\.(\d{2,4}):")
_COMPRESSION: Final = (UNCOMPRESSED, "WSQ20", "JPEGB", "JPEGL", "JP2", "JP2L", "PNG")  # of type 4
_STANDARD_PPI: Final = 500.0
NO_PRINT: Final = "has no print in it (amputated or unprinted)"


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

    def images(self) -> list[bytes]:
        """Return the images of a text record, none if it has no image field.

        The standard allows one, which reaches to the end of the record. Where software has written
        the field again, each is returned, without those that are empty.
        """
        again = rb"[\x1c\x1d]0?%d\.%d:" % (self.type, IMAGE_FIELD)
        return [image for image in re.split(again, self.fields().get(IMAGE_FIELD, b"")) if image]


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
        length = _length(reader, kind, error)
        records.append(Record(kind, idc, reader.take(length)))
    return records


def _length(reader: ByteReader, kind: int, error: Callable[[str], FpmatchError]) -> int:
    """Return the length that the record of type `kind` which begins here declares."""
    if kind in BINARY_TYPES:
        length = int.from_bytes(reader.data[reader.at : reader.at + 4], "big")
    else:
        start = _RECORD_START.match(reader.data, reader.at)
        if again := _IMAGE_AGAIN.match(reader.data, reader.at):
            raise error(f"a second field {again[0][:-1].decode()} lies outside its record's length")
        if start is None or int(start[1]) != kind:
            raise error(f"no record of type {kind} at byte {reader.at}, where one is listed")
        length = int(start[2])
    if length < 1:
        raise error(f"the record of type {kind} at byte {reader.at} declares no length")
    return length


def native_dpi(first: Record) -> float | None:
    """Return the scanning resolution in the first record, stored in pixels per millimetre."""
    try:
        return usable_dpi(round(float(first.fields().get(11, b"")) * MM_PER_INCH))
    except (ValueError, OverflowError):
        return None


def decode_image(
    data: bytes, limits: ImageLimits, decode_file: DecodeFile, number: int | None = None
) -> GreyImage:
    """Decode an image of a print, grey with 8 bits, of a file: the one of a number, from 1.

    Records without an image, of fingers that are amputated or bandaged, are passed over.
    """
    first, *others = records = read_records(data, _damaged)
    prints = [record for record in others if record.type in PRINT_TYPES]
    if not prints:
        types = ", ".join(str(record.type) for record in records)
        raise ImageReadError(f"ANSI/NIST file without a grey print (its records: type {types})")
    with_image = [record for record in prints if _has_image(record)]
    if not with_image:
        raise ImageReadError(f"ANSI/NIST file that {NO_PRINT}")
    if number is not None and number > len(with_image):
        raise ImageReadError(f"ANSI/NIST file of {len(with_image)} images, not {number}")
    record = with_image[(number or 1) - 1]
    stored = _binary_image(record, first) if record.type == GREY_FINGER else _tagged_image(record)
    image = decode_stored(stored, f"ANSI/NIST type {record.type}", limits, decode_file)
    if number is not None or len(with_image) == 1:
        return image
    several = f"the first of its {len(with_image)} images was read (--record chooses one)"
    return replace(image, notes=(*image.notes, several))


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged ANSI/NIST file ({reason})")


def _has_image(record: Record) -> bool:
    if record.type == GREY_FINGER:
        return len(record.data) > 18  # bytes of the header
    return bool(record.images())


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
    fields, images = record.fields(), record.images()
    width, height, units, across, down = (_number(fields.get(n, b"0")) for n in range(6, 11))
    name = fields.get(11, b"NONE").decode("latin-1").strip().upper()
    data, note = images[0], ""
    if name == UNCOMPRESSED and len(fields[IMAGE_FIELD]) == width * height:
        data = fields[IMAGE_FIELD]
    elif len(images) > 1:
        same = "the same" if len(set(images)) == 1 else "different ones: the first was read"
        note = f"its record has {len(images)} images in fields {record.type}.{IMAGE_FIELD}, {same}"
    depth = _number(fields.get(12, b"8"))
    across, down = across or down, down or across
    return StoredImage(data, name, width, height, units, across, down, depth, note)


def _number(text: bytes) -> int:
    digits = text.strip()
    if not digits.isdigit() or len(digits) > 12:
        raise _damaged("text where a number should be")
    return int(digits)

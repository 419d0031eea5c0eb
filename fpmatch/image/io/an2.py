"""Read the print in an ANSI/NIST-ITL transaction file (AN2, EFT, EBTS), records 4, 13 and 14.

Of the traditional encoding: records of text fields, and of type 3 to 8 in binary. Each record
begins with its length, and the first one lists the types of the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageReadError
from fpmatch.image.io.byte_reader import ByteReader
from fpmatch.image.io.record_image import RecordImage, decode_record_image
from fpmatch.image.io.resolution import MM_PER_INCH, dpi_in_units, usable_dpi

if TYPE_CHECKING:
    from fpmatch.image.io.grey import GreyImage
    from fpmatch.image.io.limits import ImageLimits
    from fpmatch.image.io.record_image import DecodeFile

SIGNATURES: Final = (b"1.001:", b"1.01:")
MAX_RECORDS: Final = 1000
MAX_FIELDS: Final = 10_000  # of one record
MAX_FIRST_RECORD: Final = 1_000_000  # bytes
_GROUP, _RECORD, _UNIT = b"\x1d", b"\x1e", b"\x1f"
_DATA: Final = 999
_BINARY_TYPES: Final = range(3, 9)
_GREY_FINGER: Final = 4  # the binary type of a print of 8 bits
_TAGGED_PRINTS: Final = (13, 14, 15)  # latent, finger, palm
_BINARY_COMPRESSION: Final = ("NONE", "WSQ20", "JPEGB", "JPEGL", "JP2", "JP2L", "PNG")
_STANDARD_PPI: Final = 500.0


@dataclass(frozen=True, slots=True)
class _Record:
    """One record of a file."""

    type: int
    data: bytes


def decode_an2(data: bytes, limits: ImageLimits, decode_file: DecodeFile) -> GreyImage:
    """Decode the first image of a print in a transaction file; `decode_file` as in `record_image`.

    Raises ImageReadError if the file is damaged or contains no grey image of a finger or palm,
    ImageError if the image is too small or too large.
    """
    first, *others = records = _records(data)
    prints = [r for r in others if r.type == _GREY_FINGER or r.type in _TAGGED_PRINTS]
    if not prints:
        types = ", ".join(str(record.type) for record in records)
        raise ImageReadError(f"ANSI/NIST file without a grey print (its records: type {types})")
    record = prints[0]
    parse = _binary_print if record.type == _GREY_FINGER else _tagged_print
    found = parse(record, _fields(first))
    image = decode_record_image(found, f"ANSI/NIST type {record.type}", limits, decode_file)
    if len(prints) == 1:
        return image
    return replace(image, notes=(*image.notes, f"the first of its {len(prints)} images was read"))


def _records(data: bytes) -> list[_Record]:
    """Split a file into its records, whose types the first one lists."""
    at = _tagged_length(data, 0)
    if at > min(len(data), MAX_FIRST_RECORD):
        raise ImageReadError("damaged ANSI/NIST file (a record ends too late)")
    first = _Record(1, data[:at])
    types = [
        _number(entry.split(_UNIT)[0])
        for entry in _fields(first).get(3, b"").split(_RECORD)[1:]
        if entry
    ]
    if len(types) > MAX_RECORDS:
        raise ImageReadError(f"ANSI/NIST file with more than {MAX_RECORDS} records")
    records = [first]
    for type_ in types:
        if type_ in _BINARY_TYPES:
            length = int.from_bytes(data[at : at + 4], "big")
        else:
            length = _tagged_length(data, at)
        if length < 5 or at + length > len(data):
            raise ImageReadError("damaged ANSI/NIST file (a record ends too late)")
        records.append(_Record(type_, data[at : at + length]))
        at += length
    return records


def _tagged_length(data: bytes, at: int) -> int:
    """Return the length of the record of text fields that begins at `at`."""
    end = data.find(_GROUP, at, at + 32)
    _, _, length = data[at:end].partition(b":")
    if end < 0 or not length.isdigit():
        raise ImageReadError("damaged ANSI/NIST file (a record without a length)")
    return _number(length)


def _fields(record: _Record) -> dict[int, bytes]:
    """Return the text fields of a record, by number; the last may be an image."""
    fields: dict[int, bytes] = {}
    at = 0
    for _ in range(MAX_FIELDS):
        name, colon, _ = record.data[at : at + 32].partition(b":")
        number = name.partition(b".")[2]
        if not colon or not number.isdigit():
            break
        start = at + len(name) + 1
        if int(number) == _DATA:
            fields[_DATA] = record.data[start:-1]
            break
        end = record.data.find(_GROUP, start)
        at = len(record.data) if end < 0 else end + 1
        fields.setdefault(int(number), record.data[start : at - 1])
    return fields


def _binary_print(record: _Record, first: dict[int, bytes]) -> RecordImage:
    body = ByteReader(record.data, "ANSI/NIST type 4")
    body.take(12)  # length, identifier, impression type, finger positions
    is_native = body.u8()
    width, height, compression = body.u16(), body.u16(), body.u8()
    if compression >= len(_BINARY_COMPRESSION):
        raise ImageReadError(f"ANSI/NIST file with an unknown compression ({compression})")
    dpi = _per_mm(first.get(11, b"")) if is_native else _STANDARD_PPI
    return RecordImage(
        body.rest(), _BINARY_COMPRESSION[compression], width, height, dpi=usable_dpi(dpi)
    )


def _tagged_print(record: _Record, _: dict[int, bytes]) -> RecordImage:
    fields = _fields(record)
    if _DATA not in fields:
        raise ImageReadError(f"damaged ANSI/NIST file (type {record.type} without an image)")
    units, across, down = (_number(fields.get(n, b"0")) for n in (8, 9, 10))
    return RecordImage(
        fields[_DATA],
        fields.get(11, b"NONE").decode("latin-1").strip().upper(),
        width=_number(fields.get(6, b"0")),
        height=_number(fields.get(7, b"0")),
        depth=_number(fields.get(12, b"8")),
        dpi=dpi_in_units(units, across, down),
    )


def _per_mm(text: bytes) -> float | None:
    try:
        return round(float(text) * MM_PER_INCH)
    except (ValueError, OverflowError):
        return None


def _number(text: bytes) -> int:
    digits = text.strip()
    if not digits.isdigit() or len(digits) > 12:
        raise ImageReadError("damaged ANSI/NIST file (text where a number should be)")
    return int(digits)

"""Read the print in an ANSI/NIST-ITL transaction file (AN2, EFT, EBTS), records 4 and 13 to 15."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.binary_records import IMAGE_FIELD, ByteReader, read_records
from fpmatch.errors import ImageReadError
from fpmatch.image.io.record_image import RecordImage, decode_record_image
from fpmatch.image.io.resolution import MM_PER_INCH, dpi_in_units, usable_dpi

if TYPE_CHECKING:
    from fpmatch.binary_records import Record
    from fpmatch.image.io.grey import GreyImage
    from fpmatch.image.io.limits import ImageLimits
    from fpmatch.image.io.record_image import DecodeFile

SIGNATURES: Final = (b"1.001:", b"1.01:")
_GREY_FINGER: Final = 4  # the binary type of a print of 8 bits
_PRINT_TYPES: Final = (_GREY_FINGER, 13, 14, 15)  # of text: latent, finger, palm
_BINARY_COMPRESSION: Final = ("NONE", "WSQ20", "JPEGB", "JPEGL", "JP2", "JP2L", "PNG")
_STANDARD_PPI: Final = 500.0


def decode_an2(data: bytes, limits: ImageLimits, decode_file: DecodeFile) -> GreyImage:
    """Decode the first image of a print in a transaction file; `decode_file` as in `record_image`.

    Raises ImageReadError if the file is damaged or contains no grey image of a finger or palm,
    ImageError if the image is too small or too large.
    """
    first, *others = records = read_records(data, _damaged)
    prints = [record for record in others if record.type in _PRINT_TYPES]
    if not prints:
        types = ", ".join(str(record.type) for record in records)
        raise ImageReadError(f"ANSI/NIST file without a grey print (its records: type {types})")
    record = prints[0]
    is_binary = record.type == _GREY_FINGER
    found = _binary_print(record.data, first) if is_binary else _tagged_print(record)
    image = decode_record_image(found, f"ANSI/NIST type {record.type}", limits, decode_file)
    if len(prints) == 1:
        return image
    return replace(image, notes=(*image.notes, f"the first of its {len(prints)} images was read"))


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged ANSI/NIST file ({reason})")


def _binary_print(data: bytes, first: Record) -> RecordImage:
    body = ByteReader(data, _damaged)
    body.take(12)  # length, identifier, impression type, finger positions
    is_native = body.number()
    width, height, compression = body.number(2), body.number(2), body.number()
    if compression >= len(_BINARY_COMPRESSION):
        raise ImageReadError(f"ANSI/NIST file with an unknown compression ({compression})")
    dpi = _per_mm(first.fields().get(11, b"")) if is_native else _STANDARD_PPI
    pixels, name = body.take(body.left), _BINARY_COMPRESSION[compression]
    return RecordImage(pixels, name, width, height, dpi=usable_dpi(dpi))


def _tagged_print(record: Record) -> RecordImage:
    fields = record.fields()
    if IMAGE_FIELD not in fields:
        raise _damaged(f"type {record.type} without an image")
    width, height, units, across, down = (_number(fields.get(n, b"0")) for n in (6, 7, 8, 9, 10))
    return RecordImage(
        fields[IMAGE_FIELD],
        fields.get(11, b"NONE").decode("latin-1").strip().upper(),
        width,
        height,
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
        raise _damaged("text where a number should be")
    return int(digits)

"""Prints inside records: ANSI/NIST-ITL files (AN2, EFT, EBTS) and finger image records.

ISO/IEC 19794-4:2005 and :2011 and ANSI/INCITS 381-2004 define finger image records. Images are
compressed like a file of their own, or bare pixels.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.base.binary_records import IMAGE_FIELD, ByteReader, read_records
from fpmatch.errors import FpmatchError, ImageReadError
from fpmatch.image.io.grey import RawSize, decode_raw
from fpmatch.image.io.resolution import dpi_in_units, usable_dpi
from fpmatch.templates.minutiae import MM_PER_INCH

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.base.binary_records import Record
    from fpmatch.image.io.grey import GreyImage, ImageLimits

    DecodeFile = Callable[[bytes, ImageLimits], GreyImage | None]
    """Decode an image file that is no record; None if its format is unknown."""

_UNCOMPRESSED: Final = "NONE"
_DEPTH: Final = 8
# Of ANSI/NIST-ITL.
_GREY_FINGER: Final = 4  # the binary type of a print of 8 bits
_PRINT_TYPES: Final = (_GREY_FINGER, 13, 14, 15)  # of text: latent, finger, palm
_COMPRESSION: Final = (_UNCOMPRESSED, "WSQ20", "JPEGB", "JPEGL", "JP2", "JP2L", "PNG")  # of type 4
_STANDARD_PPI: Final = 500.0
# Of finger image records.
_VERSION_2011: Final = b"020\x00"
_PIXELS: Final = 0  # compression code of one byte a pixel; other images are recognized by content
_PACKED: Final = 1
# Bytes of a product's identifier, by which the records of 2004 and 2005 differ.
_PRODUCT_BYTES: Final = {"ANSI/INCITS 381": 4, "ISO/IEC 19794-4:2005": 0}


class _RecordImage(NamedTuple):
    """An image as its record describes it."""

    data: bytes  # the compressed file, or the pixels
    compression: str  # its name in the standard
    width: int
    height: int
    depth: int  # bits of a pixel
    dpi: float | None
    note: str = ""


def decode_an2(data: bytes, limits: ImageLimits, decode_file: DecodeFile) -> GreyImage:
    """Decode the first image of a print, grey with 8 bits, in an ANSI/NIST-ITL file."""
    first, *others = records = read_records(data, _damaged_an2)
    prints = [record for record in others if record.type in _PRINT_TYPES]
    if not prints:
        types = ", ".join(str(record.type) for record in records)
        raise ImageReadError(f"ANSI/NIST file without a grey print (its records: type {types})")
    record = prints[0]
    is_binary = record.type == _GREY_FINGER
    stored = _binary_print(record.data, first) if is_binary else _tagged_print(record)
    image = _decode(stored, f"ANSI/NIST type {record.type}", limits, decode_file)
    if stored.note:
        image = replace(image, notes=(*image.notes, stored.note))
    if len(prints) == 1:
        return image
    return replace(image, notes=(*image.notes, f"the first of its {len(prints)} images was read"))


def _damaged_an2(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged ANSI/NIST file ({reason})")


def _binary_print(data: bytes, first: Record) -> _RecordImage:
    body = ByteReader(data, _damaged_an2)
    body.take(12)  # length, identifier, impression type, finger positions
    is_native, width, height, compression = body.numbers("B2HB")
    if compression >= len(_COMPRESSION):
        raise ImageReadError(f"ANSI/NIST file with an unknown compression ({compression})")
    dpi = usable_dpi(_per_mm(first.fields().get(11, b"")) if is_native else _STANDARD_PPI)
    pixels = body.take(body.left)
    return _RecordImage(pixels, _COMPRESSION[compression], width, height, _DEPTH, dpi)


def _tagged_print(record: Record) -> _RecordImage:
    fields, images = record.fields(), record.images()
    if IMAGE_FIELD not in fields:
        raise _damaged_an2(f"type {record.type} without an image")
    width, height, units, across, down = (_number(fields.get(n, b"0")) for n in range(6, 11))
    name = fields.get(11, b"NONE").decode("latin-1").strip().upper()
    depth, dpi = _number(fields.get(12, b"8")), dpi_in_units(units, across, down)
    data = fields[IMAGE_FIELD]
    if len(images) == 0 or (name == _UNCOMPRESSED and len(data) == width * height):
        return _RecordImage(data, name, width, height, depth, dpi)
    note = ""
    if len(images) > 1:
        same = "the same" if len(set(images)) == 1 else "different ones: the first was read"
        note = f"its record has {len(images)} images in fields {record.type}.{IMAGE_FIELD}, {same}"
    return _RecordImage(images[0], name, width, height, depth, dpi, note)


def _per_mm(text: bytes) -> float | None:
    try:
        return round(float(text) * MM_PER_INCH)
    except (ValueError, OverflowError):
        return None


def _number(text: bytes) -> int:
    digits = text.strip()
    if not digits.isdigit() or len(digits) > 12:
        raise _damaged_an2("text where a number should be")
    return int(digits)


def decode_fir(data: bytes, limits: ImageLimits, decode_file: DecodeFile) -> GreyImage:
    """Decode the first image of a finger image record; errors are as in `decode_an2`."""
    if data[4:8] == _VERSION_2011:
        return _decode(_image_of_2011(data), "ISO/IEC 19794-4:2011", limits, decode_file)
    failures: list[FpmatchError] = []
    for standard, product_bytes in _PRODUCT_BYTES.items():
        try:
            return _decode(_image_of_2005(data, product_bytes), standard, limits, decode_file)
        except FpmatchError as error:
            failures.append(error)
    raise failures[-1]


def _damaged_fir(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged finger image record ({reason})")


def _image_of_2005(data: bytes, product_bytes: int) -> _RecordImage:
    reader = ByteReader(data, _damaged_fir)
    reader.take(14 + product_bytes)  # name, version, length, product
    reader.take(5)  # device, acquisition level, number of fingers
    dpi = _dpi(reader)
    depth, compression, length = reader.numbers("2B2xL")
    width, height = reader.numbers("5x2Hx")  # after finger, views, view, quality, impression
    if length < 14:  # bytes of the finger's header
        raise _damaged_fir("its length is too small")
    return _finger(reader.take(length - 14), compression, width, height, depth, dpi)


def _image_of_2011(data: bytes) -> _RecordImage:
    reader = ByteReader(data, _damaged_fir)
    reader.take(14)  # name, version, length, number of images
    is_certified = reader.number()
    reader.take(1 + 4 + 9 + 5)  # number of fingers; length, time, device
    reader.take(5 * reader.number())  # qualities
    if is_certified:
        reader.take(3 * reader.number())
    reader.take(2)  # finger, image
    dpi = _dpi(reader)
    depth, compression, width, height, length = reader.numbers("2Bx2HL")
    return _finger(reader.take(length), compression, width, height, depth, dpi)


def _dpi(reader: ByteReader) -> float | None:
    """Read the scale's units, the scanner's resolution and the image's; return the image's."""
    return dpi_in_units(*reader.numbers("B4x2H"))


def _finger(
    data: bytes, compression: int, width: int, height: int, depth: int, dpi: float | None
) -> _RecordImage:
    if compression == _PACKED:
        raise ImageReadError("finger image record with packed pixels, which cannot be read")
    name = _UNCOMPRESSED if compression == _PIXELS else f"compression {compression}"
    return _RecordImage(data, name, width, height, depth, dpi)


def _decode(
    image: _RecordImage, record: str, limits: ImageLimits, decode_file: DecodeFile
) -> GreyImage:
    """Decode the image of a kind of `record`, at the record's resolution if known, else its own."""
    if image.compression == _UNCOMPRESSED:
        if image.depth != _DEPTH:
            raise ImageReadError(f"{record} with bare pixels of {image.depth} bits")
        size = RawSize(max(image.width, 1), max(image.height, 1))
        limits.check(size.width, size.height)
        if len(image.data) < size.bytes:
            raise ImageReadError(f"damaged {record} image (pixels are missing)")
        decoded = decode_raw(image.data[: size.bytes], size, limits)
        return replace(decoded, dpi=image.dpi, format=record)
    opened = decode_file(image.data, limits)
    if opened is None:
        raise ImageReadError(f"{record} with an image that cannot be read ({image.compression})")
    notes = opened.notes
    height, width = opened.pixels.shape
    if (height, width) != (image.height, image.width):
        given = f"its record gives a size of {image.width} x {image.height} pixels"
        notes += (f"{given}, but its image has {width} x {height}",)
    dpi = opened.dpi if image.dpi is None else image.dpi
    return replace(opened, dpi=dpi, format=f"{record}, {opened.format}", notes=notes)

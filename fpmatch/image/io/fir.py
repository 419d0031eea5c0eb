"""Read finger image records: ISO/IEC 19794-4:2005 and :2011, ANSI/INCITS 381-2004."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.binary_records import ByteReader
from fpmatch.errors import FpmatchError, ImageReadError
from fpmatch.image.io.record_image import UNCOMPRESSED, RecordImage, decode_record_image
from fpmatch.image.io.resolution import dpi_in_units

if TYPE_CHECKING:
    from fpmatch.image.io.grey import GreyImage
    from fpmatch.image.io.limits import ImageLimits
    from fpmatch.image.io.record_image import DecodeFile

SIGNATURES: Final = (b"FIR\x00",)
_VERSION_2011: Final = b"020\x00"
_PIXELS: Final = 0  # compression code of one byte a pixel; other images are recognized by content
_PACKED: Final = 1
# Bytes of a product's identifier, by which the records of 2004 and 2005 differ.
_PRODUCT_BYTES: Final = {"ANSI/INCITS 381": 4, "ISO/IEC 19794-4:2005": 0}


def decode_fir(data: bytes, limits: ImageLimits, decode_file: DecodeFile) -> GreyImage:
    """Decode the first image of a finger image record; `decode_file` as in `record_image`.

    Raises ImageReadError if the record is damaged, or its pixels are packed or not of 8 bits;
    ImageError if the image is too small or too large.
    """
    if data[4:8] == _VERSION_2011:
        image = _image_of_2011(data)
        return decode_record_image(image, "ISO/IEC 19794-4:2011", limits, decode_file)
    failures: list[FpmatchError] = []
    for standard, product_bytes in _PRODUCT_BYTES.items():
        try:
            image = _image_of_2005(data, product_bytes)
            return decode_record_image(image, standard, limits, decode_file)
        except FpmatchError as error:
            failures.append(error)
    raise failures[-1]


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged finger image record ({reason})")


def _image_of_2005(data: bytes, product_bytes: int) -> RecordImage:
    reader = ByteReader(data, _damaged)
    reader.take(14 + product_bytes)  # name, version, length, product
    reader.take(5)  # device, acquisition level, number of fingers
    dpi = _dpi(reader)
    depth, compression = reader.number(), reader.number()
    reader.take(2)
    length = reader.number(4) - 14  # without the finger's header
    reader.take(5)  # finger, number of views, view, quality, kind of impression
    width, height = reader.number(2), reader.number(2)
    reader.take(1)
    if length < 0:
        raise _damaged("its length is too small")
    return _record_image(reader.take(length), compression, width, height, depth, dpi)


def _image_of_2011(data: bytes) -> RecordImage:
    reader = ByteReader(data, _damaged)
    reader.take(14)  # name, version, length, number of images
    is_certified = reader.number()
    reader.take(1 + 4 + 9 + 5)  # number of fingers; length, time, device
    reader.take(5 * reader.number())  # qualities
    if is_certified:
        reader.take(3 * reader.number())
    reader.take(2)  # finger, image
    dpi = _dpi(reader)
    depth, compression = reader.number(), reader.number()
    reader.take(1)  # kind of impression
    width, height = reader.number(2), reader.number(2)
    return _record_image(reader.take(reader.number(4)), compression, width, height, depth, dpi)


def _dpi(reader: ByteReader) -> float | None:
    """Read the scale's units, the scanner's resolution and the image's; return the image's."""
    units = reader.number()
    reader.take(4)
    return dpi_in_units(units, reader.number(2), reader.number(2))


def _record_image(
    data: bytes, compression: int, width: int, height: int, depth: int, dpi: float | None
) -> RecordImage:
    if compression == _PACKED:
        raise ImageReadError("finger image record with packed pixels, which cannot be read")
    name = UNCOMPRESSED if compression == _PIXELS else f"compression {compression}"
    return RecordImage(data, name, width, height, depth, dpi)

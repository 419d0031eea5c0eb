"""Read finger image records: ISO/IEC 19794-4:2005 and :2011, ANSI/INCITS 381-2004."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError, ImageReadError
from fpmatch.image.io.byte_reader import ByteReader
from fpmatch.image.io.record_image import UNCOMPRESSED, RecordImage, decode_record_image
from fpmatch.image.io.resolution import dpi_in_units

if TYPE_CHECKING:
    from fpmatch.image.io.byte_reader import Picture
    from fpmatch.image.io.limits import ImageLimits

SIGNATURES: Final = (b"FIR\x00",)
_NAME: Final = "finger image record"
_VERSION_2011: Final = b"020\x00"
_PIXELS: Final = 0  # compression code of one byte a pixel; all others are told by their content
_PACKED: Final = 1
# Bytes of the 2004 and 2005 records between their length and the resolution: ANSI's has a
# product's identifier besides.
_PRODUCT_BYTES: Final = {"ANSI/INCITS 381": 4, "ISO/IEC 19794-4:2005": 0}


def decode_finger_image_record(data: bytes, limits: ImageLimits) -> Picture:
    """Decode the first image of a finger image record.

    Parameters
    ----------
    data : bytes
        The file.
    limits : ImageLimits
        Sizes that are refused, before decoding.

    Returns
    -------
    Picture
        The print, at the resolution that the record tells.

    Raises
    ------
    ImageReadError
        If the record is damaged, or its pixels are packed or not of 8 bits.
    ImageError
        If the picture is too small or too large.
    """
    if data[4:8] == _VERSION_2011:
        return decode_record_image(_image_of_2011(data), "ISO/IEC 19794-4:2011", (), limits)
    failures: list[FpmatchError] = []
    for standard, product_bytes in _PRODUCT_BYTES.items():
        try:
            image = _image_of_2005(data, product_bytes)
            return decode_record_image(image, standard, (), limits)
        except FpmatchError as error:
            failures.append(error)
    raise failures[-1]


def _image_of_2005(data: bytes, product_bytes: int) -> RecordImage:
    reader = ByteReader(data, _NAME)
    reader.take(14 + product_bytes)  # name, version, length, product
    reader.take(5)  # device, acquisition level, number of fingers
    dpi = _dpi(reader)
    depth, compression = reader.u8(), reader.u8()
    reader.take(2)
    length = reader.u32()
    reader.take(5)  # finger, number of views, view, quality, kind of impression
    width, height = reader.u16(), reader.u16()
    reader.take(1)
    if length < 14:
        raise ImageReadError(f"damaged {_NAME} image (its length is too small)")
    return _embedded(reader.take(length - 14), compression, width, height, depth, dpi)


def _image_of_2011(data: bytes) -> RecordImage:
    reader = ByteReader(data, _NAME)
    reader.take(14)  # name, version, length, number of images
    is_certified = reader.u8()
    reader.take(1 + 4 + 9 + 5)  # number of fingers; length, time, device
    reader.take(5 * reader.u8())  # qualities
    if is_certified:
        reader.take(3 * reader.u8())
    reader.take(2)  # finger, image
    dpi = _dpi(reader)
    depth, compression = reader.u8(), reader.u8()
    reader.take(1)  # kind of impression
    width, height = reader.u16(), reader.u16()
    return _embedded(reader.take(reader.u32()), compression, width, height, depth, dpi)


def _dpi(reader: ByteReader) -> float | None:
    """Read the scale's units, the scanner's resolution and the image's; return the image's."""
    units = reader.u8()
    reader.take(4)
    return dpi_in_units(units, reader.u16(), reader.u16())


def _embedded(
    data: bytes, compression: int, width: int, height: int, depth: int, dpi: float | None
) -> RecordImage:
    if compression == _PACKED:
        raise ImageReadError(f"{_NAME} with packed pixels, which cannot be read")
    name = UNCOMPRESSED if compression == _PIXELS else f"compression {compression}"
    return RecordImage(data, name, width, height, depth, dpi)

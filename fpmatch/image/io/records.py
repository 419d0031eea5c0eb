"""Images inside records, and finger image records.

ISO/IEC 19794-4:2005 and :2011 and ANSI/INCITS 381-2004 define finger image records. Images in
records are compressed like a file of their own, or bare pixels.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.base.binary_records import ByteReader
from fpmatch.errors import FpmatchError, ImageReadError
from fpmatch.image.io.grey import RawSize, decode_raw, with_square_pixels
from fpmatch.image.io.resolution import dpi_in_units, usable_axes

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage, ImageLimits

    DecodeFile = Callable[[bytes, ImageLimits], GreyImage | None]
    """Decode an image file that is no record; None if its format is unknown."""

UNCOMPRESSED: Final = "NONE"
_DEPTH: Final = 8
_VERSION_2011: Final = b"020\x00"
_PIXELS: Final = 0  # compression code of one byte a pixel; other images are recognized by content
_PACKED: Final = 1
# Bytes of a product's identifier, by which the records of 2004 and 2005 differ.
_PRODUCT_BYTES: Final = {"ANSI/INCITS 381": 4, "ISO/IEC 19794-4:2005": 0}


class StoredImage(NamedTuple):
    """An image as its record describes it, `units` as `dpi_in_units` has them."""

    data: bytes  # the compressed file, or the pixels
    compression: str  # its name in the standard
    width: int
    height: int
    units: int
    across: float  # pixels a unit, 0 if unknown
    down: float
    depth: int = _DEPTH  # bits of a pixel
    note: str = ""


def decode_fir(data: bytes, limits: ImageLimits, decode_file: DecodeFile) -> GreyImage:
    """Decode the first image of a finger image record."""
    if data[4:8] == _VERSION_2011:
        return decode_stored(_image_of_2011(data), "ISO/IEC 19794-4:2011", limits, decode_file)
    failures: list[FpmatchError] = []
    for standard, product_bytes in _PRODUCT_BYTES.items():
        try:
            return decode_stored(_image_of_2005(data, product_bytes), standard, limits, decode_file)
        except FpmatchError as error:
            failures.append(error)
    raise failures[-1]


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged finger image record ({reason})")


def _image_of_2005(data: bytes, product_bytes: int) -> StoredImage:
    reader = ByteReader(data, _damaged)
    reader.take(14 + product_bytes)  # name, version, length, product
    reader.take(5)  # device, acquisition level, number of fingers
    units, across, down = reader.numbers("B4x2H")  # without the resolution of the scanner
    depth, compression, length = reader.numbers("2B2xL")
    width, height = reader.numbers("5x2Hx")  # after finger, views, view, quality, impression
    if length < 14:  # bytes of the finger's header
        raise _damaged("its length is too small")
    return _finger(
        reader.take(length - 14), compression, width, height, depth, (units, across, down)
    )


def _image_of_2011(data: bytes) -> StoredImage:
    reader = ByteReader(data, _damaged)
    reader.take(14)  # name, version, length, number of images
    is_certified = reader.number()
    reader.take(1 + 4 + 9 + 5)  # number of fingers; length, time, device
    reader.take(5 * reader.number())  # qualities
    if is_certified:
        reader.take(3 * reader.number())
    reader.take(2)  # finger, image
    units, across, down = reader.numbers("B4x2H")
    depth, compression, width, height, length = reader.numbers("2Bx2HL")
    return _finger(reader.take(length), compression, width, height, depth, (units, across, down))


def _finger(
    data: bytes, compression: int, width: int, height: int, depth: int, scale: tuple[int, int, int]
) -> StoredImage:
    if compression == _PACKED:
        raise ImageReadError("finger image record with packed pixels, which cannot be read")
    name = UNCOMPRESSED if compression == _PIXELS else f"compression {compression}"
    return StoredImage(data, name, width, height, *scale, depth)


def decode_stored(
    image: StoredImage, record: str, limits: ImageLimits, decode_file: DecodeFile
) -> GreyImage:
    """Decode the image of a kind of `record`, at the record's resolution if known, else its own.

    Where those along the axes differ, the pixels are resampled at the higher one.
    """
    axes = usable_axes(*(dpi_in_units(image.units, n) for n in (image.across, image.down)))
    if axes is not None and limits.dpi is None:
        limits = replace(limits, dpi=max(axes))
    if image.compression == UNCOMPRESSED:
        if image.depth != _DEPTH:
            raise ImageReadError(f"{record} with bare pixels of {image.depth} bits")
        size = RawSize(max(image.width, 1), max(image.height, 1))
        limits.check(size.width, size.height)
        if len(image.data) < size.bytes:
            raise ImageReadError(f"damaged {record} image (pixels are missing)")
        decoded = replace(decode_raw(image.data[: size.bytes], size, limits), format=record)
    else:
        opened = decode_file(image.data, limits)
        if opened is None:
            reason = f"an image that cannot be read ({image.compression})"
            raise ImageReadError(f"{record} with {reason}")
        decoded = replace(opened, format=f"{record}, {opened.format}")
    height, width = decoded.pixels.shape
    notes = (*decoded.notes, image.note) if image.note else decoded.notes
    if (height, width) != (image.height, image.width):
        given = f"its record gives a size of {image.width} x {image.height} pixels"
        notes += (f"{given}, but its image has {width} x {height}",)
    decoded = replace(decoded, notes=notes)
    return decoded if axes is None else with_square_pixels(decoded, axes, limits)

"""The registry of image formats: the reader of a file is found by its first bytes.

Some files are records that contain an image, compressed like a file of its own or bare pixels:
those of ANSI/NIST-ITL, and the finger image records of ISO/IEC 19794-4:2005 and :2011 and
ANSI/INCITS 381-2004.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.base.binary_records import ByteReader
from fpmatch.base.plugins import AN2_SIGNATURES, FMR_SIGNATURE, agency
from fpmatch.errors import FpmatchError, ImageReadError
from fpmatch.image.io import pillow_formats
from fpmatch.image.io.grey import RawSize, decode_ihead, decode_raw, with_square_pixels
from fpmatch.image.io.resolution import dpi_in_units, usable_axes

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage, ImageLimits

# First bytes of formats.
WSQ_SIGNATURE: Final = b"\xff\xa0"
IHEAD_SIGNATURE: Final = b"288\x00"
FIR_SIGNATURE: Final = b"FIR\x00"

UNCOMPRESSED: Final = "NONE"
_DEPTH: Final = 8
_VERSION_2011: Final = b"020\x00"
_PIXELS: Final = 0  # compression code of one byte a pixel; other images are recognized by content
_PACKED: Final = 1
# Bytes of a product's identifier, by which the records of 2004 and 2005 differ.
_PRODUCT_BYTES: Final = {"ANSI/INCITS 381": 4, "ISO/IEC 19794-4:2005": 0}


class ImageReader(NamedTuple):
    """Read one format of image file."""

    name: str
    signatures: tuple[bytes, ...]  # the first bytes of its files
    decode: Callable[..., GreyImage]  # of bytes and ImageLimits; raises FpmatchError
    holds_several: bool = False
    """Whether `decode` also takes the number of an image, from 1."""


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


def _decode_wsq(data: bytes, limits: ImageLimits) -> GreyImage:
    decoded: GreyImage = agency("wsq").decode_wsq(data, limits)  # loads with the first file
    return decoded


def _decode_an2(data: bytes, limits: ImageLimits, record: int | None = None) -> GreyImage:
    decoded: GreyImage = agency("an2").decode_image(data, limits, record)
    return decoded


def _decode_fir(data: bytes, limits: ImageLimits) -> GreyImage:
    """Decode the first image of a finger image record."""
    if data[4:8] == _VERSION_2011:
        return decode_stored(_image_of_2011(data), "ISO/IEC 19794-4:2011", limits)
    failures: list[FpmatchError] = []
    for standard, product_bytes in _PRODUCT_BYTES.items():
        try:
            return decode_stored(_image_of_2005(data, product_bytes), standard, limits)
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


def decode_stored(image: StoredImage, record: str, limits: ImageLimits) -> GreyImage:
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
        reader = _reader_of(image.data, FILE_READERS)
        if reader is None:
            reason = f"an image that cannot be read ({image.compression})"
            raise ImageReadError(f"{record} with {reason}")
        opened = reader.decode(image.data, limits)
        decoded = replace(opened, format=f"{record}, {opened.format}")
    height, width = decoded.pixels.shape
    notes = (*decoded.notes, image.note) if image.note else decoded.notes
    if (height, width) != (image.height, image.width):
        given = f"its record gives a size of {image.width} x {image.height} pixels"
        notes += (f"{given}, but its image has {width} x {height}",)
    decoded = replace(decoded, notes=notes)
    return decoded if axes is None else with_square_pixels(decoded, axes, limits)


FILE_READERS: Final = (
    *(
        ImageReader(name, signatures, partial(pillow_formats.decode_with_pillow, name))
        for name, signatures in pillow_formats.SIGNATURES.items()
    ),
    ImageReader("WSQ", (WSQ_SIGNATURE,), _decode_wsq),
    ImageReader("IHead", (IHEAD_SIGNATURE,), decode_ihead),
)
"""The formats of a single image."""


READERS: Final = (
    *FILE_READERS,
    ImageReader("AN2", AN2_SIGNATURES, _decode_an2, holds_several=True),
    ImageReader("FIR", (FIR_SIGNATURE,), _decode_fir),
)
"""All formats: single images, and records that contain one."""

# First bytes of files that people take for images, and what those files are.
_OTHERS: Final = (
    (FMR_SIGNATURE, "a minutiae template, ISO/IEC 19794-2 or ANSI 378"),
    (b"FP3", "a template of libfprint"),
    (b"\x89FPS", "a sealed template: only galleries open sealed templates"),
    (b"%PDF", "a PDF document"),
    (b"%!PS", "a PostScript document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"8BPS", "a Photoshop document"),
    (b"<?xml", "an XML document"),
    *((start, "an HTML page") for start in (b"<!DOCTYPE", b"<html")),
    (b"<svg", "an SVG drawing"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x93NUMPY", "a NumPy array"),
    *((start, "a JPEG XL image") for start in (b"\xff\x0a", b"\x00\x00\x00\x0cJXL ")),
    (b"II\xbc", "a JPEG XR image"),
)
_BOXES: Final = {b"ftypheic": "a HEIC image", b"ftypavif": "an AVIF image"}
_DICOM_AT: Final = 128


def _reader_of(data: bytes, readers: tuple[ImageReader, ...] = READERS) -> ImageReader | None:
    return next((reader for reader in readers if data.startswith(reader.signatures)), None)


def is_image_file(data: bytes) -> bool:
    """Return whether a file begins like one of `FILE_READERS`, so that it is no template."""
    return _reader_of(data, FILE_READERS) is not None


def is_known(data: bytes) -> bool:
    """Return whether a file begins like one of any format that is read or named."""
    return _reader_of(data) is not None or bool(_other_kind(data))


def find_reader(data: bytes) -> ImageReader:
    """Return the reader of a file; raise ImageReadError, which names well-known other formats."""
    if reader := _reader_of(data):
        return reader
    kind = _other_kind(data)
    raise ImageReadError("not an image of a known format" + (f" ({kind})" if kind else ""))


def _other_kind(data: bytes) -> str:
    """Return which well-known other format a file has, "" for none."""
    if data[_DICOM_AT : _DICOM_AT + 4] == b"DICM":
        return "a DICOM file"
    kind = next((kind for start, kind in _OTHERS if data.startswith(start)), "")
    return _BOXES.get(data[4:12], kind)

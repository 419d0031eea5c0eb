"""The registry of image formats: the reader of a file is found by its first bytes.

Records of ANSI/NIST-ITL contain an image, compressed like a file of its own or bare pixels.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from fpmatch.base.plugins import AN2_SIGNATURES, FMR_SIGNATURE, agency
from fpmatch.errors import ImageReadError
from fpmatch.image.io import pillow_formats
from fpmatch.image.io.grey import RawSize, decode_ihead, decode_raw, with_square_pixels
from fpmatch.image.io.resolution import dpi_in_units, usable_axes

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage, ImageLimits

UNCOMPRESSED: Final = "NONE"
_DEPTH: Final = 8


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


def _agency(module: str, function: str, *given: Any) -> GreyImage:
    """Decode by a function of a module of agencies, which loads with the first of its files."""
    decoded: GreyImage = getattr(agency(module), function)(*given)
    return decoded


READERS: Final = (
    *(
        ImageReader(name, signatures, partial(pillow_formats.decode_with_pillow, name))
        for name, signatures in pillow_formats.SIGNATURES.items()
    ),
    ImageReader("WSQ", (b"\xff\xa0",), partial(_agency, "wsq", "decode_wsq")),
    ImageReader("IHead", (b"288\x00",), decode_ihead),
    ImageReader("AN2", AN2_SIGNATURES, partial(_agency, "an2", "decode_image"), holds_several=True),
)
"""All formats: single images, and records that contain some."""

# First bytes of files that people take for images, and what those files are.
_OTHERS: Final = (
    (FMR_SIGNATURE, "a minutiae template, ISO/IEC 19794-2 or ANSI 378"),
    (b"FIR\x00", "a finger image record, ISO/IEC 19794-4 or ANSI 381"),
    (b"FP3", "a template of libfprint"),
    (b"\x89FPS", "a sealed template: only galleries open sealed templates"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"8BPS", "a Photoshop document"),
    (b"<?xml", "an XML document"),
    *((start, "an HTML page") for start in (b"<!DOCTYPE", b"<html")),
    (b"<svg", "an SVG drawing"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x93NUMPY", "a NumPy array"),
    *((start, "a JPEG XL image") for start in (b"\xff\x0a", b"\x00\x00\x00\x0cJXL ")),
)
_BOXES: Final = {b"ftypheic": "a HEIC image", b"ftypavif": "an AVIF image"}
_DICOM_AT: Final = 128


def sniff(head: bytes) -> ImageReader | None:
    """Return the reader of a file that begins like this; None where there is none."""
    return next((reader for reader in READERS if head.startswith(reader.signatures)), None)


def other_kind(head: bytes) -> str:
    """Return which well-known format without a reader a file has, "" for none."""
    if head[_DICOM_AT : _DICOM_AT + 4] == b"DICM":
        return "a DICOM file"
    kind = next((kind for start, kind in _OTHERS if head.startswith(start)), "")
    return _BOXES.get(head[4:12], kind)


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
        reader = sniff(image.data)
        if reader is None or reader.holds_several:
            reason = f"an image that cannot be read ({image.compression})"
            raise ImageReadError(f"{record} with {reason}")
        opened = reader.decode(image.data, limits)
        decoded = replace(opened, format=f"{record}, {opened.format}")
    height, width = decoded.pixels.shape
    notes = decoded.notes
    if (height, width) != (image.height, image.width):
        given = f"its record gives a size of {image.width} x {image.height} pixels"
        notes += (f"{given}, but its image has {width} x {height}",)
    decoded = replace(decoded, notes=notes)
    return decoded if axes is None else with_square_pixels(decoded, axes, limits)

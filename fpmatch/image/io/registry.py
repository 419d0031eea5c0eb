"""The registry of image formats: the reader of a file is found by its first bytes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.base.plugins import AN2_SIGNATURES, agency
from fpmatch.errors import ImageReadError
from fpmatch.image.io import pillow_formats
from fpmatch.image.io.grey import decode_ihead

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage, ImageLimits


class ImageReader(NamedTuple):
    """Read one format of image file."""

    name: str
    signatures: tuple[bytes, ...]  # the first bytes of its files
    decode: Callable[[bytes, ImageLimits], GreyImage]  # raises FpmatchError with the reason
    choose: Callable[[int], Callable[[bytes, ImageLimits], GreyImage]] | None = None
    """Return what decodes the image of a number, from 1, in formats of several."""


# First bytes of the formats whose readers load with the first file of theirs.
WSQ_SIGNATURE: Final = b"\xff\xa0"
IHEAD_SIGNATURE: Final = b"288\x00"
FIR_SIGNATURE: Final = b"FIR\x00"


def _decode_wsq(data: bytes, limits: ImageLimits) -> GreyImage:
    decoded: GreyImage = agency("wsq").decode_wsq(data, limits)
    return decoded


def _decode_an2(data: bytes, limits: ImageLimits, record: int | None = None) -> GreyImage:
    decoded: GreyImage = agency("an2").decode_image(data, limits, _decode_file, record)
    return decoded


def _decode_fir(data: bytes, limits: ImageLimits) -> GreyImage:
    from fpmatch.image.io.records import decode_fir  # noqa: PLC0415

    return decode_fir(data, limits, _decode_file)


FILE_READERS: Final = (
    *(
        ImageReader(name, signatures, partial(pillow_formats.decode_with_pillow, name))
        for name, signatures in pillow_formats.SIGNATURES.items()
    ),
    ImageReader("WSQ", (WSQ_SIGNATURE,), _decode_wsq),
    ImageReader("IHead", (IHEAD_SIGNATURE,), decode_ihead),
)
"""The formats of a single image."""


def is_image_file(data: bytes) -> bool:
    """Return whether a file begins like one of `FILE_READERS`, so that it is no template."""
    return any(data.startswith(reader.signatures) for reader in FILE_READERS)


def is_known(data: bytes) -> bool:
    """Return whether a file begins like one of any format that is read or named."""
    return any(data.startswith(reader.signatures) for reader in READERS) or bool(other_kind(data))


def _decode_file(data: bytes, limits: ImageLimits) -> GreyImage | None:
    """Decode an image inside a record; None if its format is unknown."""
    for reader in FILE_READERS:
        if data.startswith(reader.signatures):
            return reader.decode(data, limits)
    return None


READERS: Final = (
    *FILE_READERS,
    ImageReader("AN2", AN2_SIGNATURES, _decode_an2, lambda n: partial(_decode_an2, record=n)),
    ImageReader("FIR", (FIR_SIGNATURE,), _decode_fir),
)
"""All formats: single images, and records that contain one."""

# First bytes of files that people take for images, and what those files are.
_OTHERS: Final = (
    (b"FMR\x00", "a minutiae template, ISO/IEC 19794-2 or ANSI 378"),
    (b"FP3", "a template of libfprint"),
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


def find_reader(data: bytes) -> ImageReader:
    """Return the reader of a file; raise ImageReadError, which names well-known other formats."""
    for reader in READERS:
        if data.startswith(reader.signatures):
            return reader
    kind = other_kind(data)
    raise ImageReadError("not an image of a known format" + (f" ({kind})" if kind else ""))


def other_kind(data: bytes) -> str:
    """Return which well-known other format a file has, "" for none."""
    if data[_DICOM_AT : _DICOM_AT + 4] == b"DICM":
        return "a DICOM file"
    kind = next((kind for start, kind in _OTHERS if data.startswith(start)), "")
    return _BOXES.get(data[4:12], kind)

"""The registry of image formats: find the reader of a file by how the file begins."""

from __future__ import annotations

from typing import Final

from fpmatch.errors import ImageReadError
from fpmatch.image.io import an2, fir
from fpmatch.image.io.readers import PICTURE_READERS, ImageReader

READERS: Final = (
    *PICTURE_READERS,
    ImageReader("AN2", an2.SIGNATURES, an2.decode_an2),
    ImageReader("FIR", fir.SIGNATURES, fir.decode_finger_image_record),
)

# How files begin that people take for images, and what they are.
_OTHERS: Final = (
    (b"FMR\x00", "a minutiae template, ISO/IEC 19794-2 or ANSI 378"),
    (b"%PDF", "a PDF document"),
    (b"%!PS", "a PostScript document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"8BPS", "a Photoshop document"),
    (b"<?xml", "an XML document"),
    (b"<!DOCTYPE", "an HTML page"),
    (b"<html", "an HTML page"),
    (b"<svg", "an SVG drawing"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"\xff\x0a", "a JPEG XL image"),
    (b"\x00\x00\x00\x0cJXL ", "a JPEG XL image"),
    (b"II\xbc", "a JPEG XR image"),
)
_BOXES: Final = {b"ftypheic": "a HEIC image", b"ftypavif": "an AVIF image"}
_DICOM_AT: Final = 128


def reader_of(data: bytes) -> ImageReader:
    """Return the reader of the format that `data` begins like.

    Parameters
    ----------
    data : bytes
        A file, or how it begins.

    Returns
    -------
    ImageReader
        Its reader.

    Raises
    ------
    ImageReadError
        If the format is not known, with a word on what it is where that is.

    Examples
    --------
    >>> reader_of(b"P5 64 64 255 ").name
    'PPM'
    """
    for reader in READERS:
        if data.startswith(reader.signatures):
            return reader
    kind = _kind_of(data)
    raise ImageReadError("not an image of a known format" + (f" ({kind})" if kind else ""))


def _kind_of(data: bytes) -> str:
    """Return what a file is that is no image of a known format; "" where that is not known."""
    if data[_DICOM_AT : _DICOM_AT + 4] == b"DICM":
        return "a DICOM file"
    named = next((kind for start, kind in _OTHERS if data.startswith(start)), "")
    return _BOXES.get(data[4:12], named)

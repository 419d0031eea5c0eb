"""Read image files as 8-bit grey images; the reader of a file is found by its first bytes.

Records of ANSI/NIST-ITL contain an image, compressed like a file of its own or bare pixels.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.parsing import read_regular
from fpmatch.base.plugins import AN2_SIGNATURES, FMR_SIGNATURE, agency
from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.grey import (
    DEFAULT_LIMITS,
    FEWEST_RAW_BYTES,
    GreyImage,
    ImageLimits,
    RawSize,
    decode_raw,
    dpi_in_units,
    grey_image,
    usable_axes,
    with_square_pixels,
)
from fpmatch.image.io.pillow_formats import SIGNATURES, convert_opened, decode_with_pillow
from fpmatch.image.quality.polarity import INVERTED, check_polarity, is_inverted
from fpmatch.image.quality.ridge_scale import contradiction
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from fpmatch.image.quality.polarity import Polarity

__all__ = ["GreyImage", "ImageLimits", "decode_image", "read_image"]

_NO_IMAGES: Final = ("a folder, not an image", "not a regular file, not an image")
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
        ImageReader(name, signatures, partial(decode_with_pillow, name))
        for name, signatures in SIGNATURES.items()
    ),
    ImageReader("WSQ", (b"\xff\xa0",), partial(_agency, "wsq", "decode_wsq")),
    ImageReader("AN2", AN2_SIGNATURES, partial(_agency, "an2", "decode_image"), holds_several=True),
)
"""All formats: single images, and records that contain some."""

# First bytes of files that people take for images, and what those files are.
_OTHERS: Final = (
    (FMR_SIGNATURE, "a minutiae template, ISO/IEC 19794-2 or ANSI 378"),
    (b"FIR\x00", "a finger image record, ISO/IEC 19794-4 or ANSI 381"),
    (b"288\x00", "an IHead image of NIST"),
    (b"FP3", "a template of libfprint"),
    *((start, "a BigTIFF image") for start in (b"II+\x00", b"MM\x00+")),
    *((start, "a PNM image in digits") for start in (b"P1\n", b"P2\n", b"P3\n")),
    (b"\x89FPS", "a sealed template: only galleries open sealed templates"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"<?xml", "an XML document"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x93NUMPY", "a NumPy array"),
    *((start, "a JPEG XL image") for start in (b"\xff\x0a", b"\x00\x00\x00\x0cJXL ")),
)
_BOXES: Final = {b"ftypheic": "a HEIC image", b"ftypavif": "an AVIF image"}
_DICOM_AT: Final = 128


def read_image(
    image: Any,
    *,
    limits: ImageLimits = DEFAULT_LIMITS,
    raw_sizes: Sequence[RawSize] = (),
    polarity: Polarity = "auto",
    dpi: float | None = None,
    record: int | None = None,
) -> GreyImage:
    """Read an image, whatever represents it, as grey values with its resolution.

    Parameters
    ----------
    image : str, path-like, bytes, ndarray, PIL image or GreyImage
        A file or its bytes; pixels, as for `grey_image`; an image of PIL, of which the tags are
        obeyed; or a `GreyImage`, which is returned as it is. A file is a TIFF, PNG, BMP, JPEG,
        PGM/PPM/PBM, GIF, WebP, JPEG 2000 or WSQ file of 1, 8, 16 or 32 bits a sample; grey, palette
        or colour; or a record with an image, of ANSI/NIST-ITL (AN2). It is read upright, as its tag
        of orientation says. Of transparent pixels see `grey_image`; of several images the first is
        read.
    limits : ImageLimits
        Sizes that are refused, before reading and decoding.
    raw_sizes : sequence of RawSize
        Sizes of files without a header: a file of as many bytes as one of them has pixels is read
        as those pixels.
    polarity : str
        "dark": the grey values stay; "white": they are inverted; "auto": they are inverted where
        the print certainly shows white ridges.
    dpi : float, optional
        Resolution that replaces the file's own.
    record : int, optional
        Number, from 1, of the image that is read of an ANSI/NIST-ITL file; by default the first.
        Fingers without an image are not counted, and other files have one image.

    Returns
    -------
    GreyImage
        `dpi` is None unless the file gives one value for both axes above 100 and up to 4000 dpi;
        lower ones (1, 72, 96) are defaults of programs. It is None too where the distance of the
        ridges clearly contradicts the file's value, which a note names, unless `dpi` is given.

    Raises
    ------
    ImageReadError
        If the file is missing, empty, damaged, or not an image.
    ImageError
        If the image is too small or too large, its values make no grey image, or the polarity is
        unknown.
    ResolutionError
        If `dpi` is outside 100 to 4000.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from PIL import Image
    >>> from fpmatch import read_image
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "print.png")
    ...     Image.new("L", (64, 80), 200).save(path, dpi=(500, 500))
    ...     image = read_image(path)
    >>> image.pixels.shape, image.dpi
    ((80, 64), 500.0)
    """
    if isinstance(image, GreyImage):
        return image
    if dpi is not None:
        limits = replace(limits, dpi=check_dpi(dpi))
    if isinstance(image, np.ndarray):
        return _settled(grey_image(image, limits=limits), polarity, dpi)
    if hasattr(image, "getexif"):  # of PIL
        return _settled(convert_opened(lambda: image, limits, image.format or "PIL"), polarity, dpi)
    how: dict[str, Any] = {"raw_sizes": raw_sizes, "polarity": polarity, "dpi": dpi}
    how |= {"limits": limits, "record": record}
    if isinstance(image, bytes):
        return decode_image(image, "image", **how)
    with name_errors(image):
        most = int(limits.max_file_megabytes * 1e6)
        data = read_regular(image, most, ImageReadError, _NO_IMAGES)
    return decode_image(data, str(image), **how)


def decode_image(
    data: bytes,
    source: str,
    *,
    limits: ImageLimits = DEFAULT_LIMITS,
    raw_sizes: Sequence[RawSize] = (),
    polarity: Polarity = "auto",
    dpi: float | None = None,
    record: int | None = None,
) -> GreyImage:
    """Decode the bytes of an image file as `read_image` does; errors start with `source`."""
    if dpi is not None:
        limits = replace(limits, dpi=check_dpi(dpi))
    with name_errors(source):
        if len(data) > limits.max_file_megabytes * 1e6:
            raise ImageReadError(f"the file is larger than {limits.max_file_megabytes:g} MB")
        if not data:
            raise ImageReadError("the file is empty")
        size = next((size for size in raw_sizes if size.bits(len(data))), None)
        if size is not None:
            image = decode_raw(data, size, limits)
        elif (reader := sniff(data)) is not None:
            image = reader.decode(data, limits, *((record,) if reader.holds_several else ()))
        else:
            raise ImageReadError(_why_unknown(data, raw_sizes))
    return _settled(replace(image, source=source), polarity, dpi)


def _why_unknown(data: bytes, raw_sizes: Sequence[RawSize]) -> str:
    kind = "a DICOM file" if data[_DICOM_AT : _DICOM_AT + 4] == b"DICM" else ""
    kind = kind or next((kind for start, kind in _OTHERS if data.startswith(start)), "")
    kind = _BOXES.get(data[4:12], kind)
    why = "not an image of a known format" + (f" ({kind})" if kind else "")
    if raw_sizes:
        sizes = ", ".join(f"{size} ({size.bytes})" for size in raw_sizes)
        why += f"; its {len(data)} bytes are no raw {sizes}"
    elif not (kind or data.isascii() or len(data) < FEWEST_RAW_BYTES):
        why += f"; if its {len(data)} bytes are pixels: --raw WIDTHxHEIGHT"
    return why


def _settled(image: GreyImage, polarity: Polarity, dpi: float | None) -> GreyImage:
    """Return an image with dark ridges, without a resolution that its ridges contradict."""
    why = contradiction(image.pixels, image.dpi) if image.dpi is not None and dpi is None else ""
    if why:
        image = replace(image, dpi=None, notes=(*image.notes, why))
    inverted = polarity == "white"
    if check_polarity(polarity) == "auto":
        inverted = is_inverted(image.pixels)
    if not inverted:
        return image
    return replace(image, pixels=255 - image.pixels, notes=(*image.notes, INVERTED))


@contextmanager
def name_errors(source: object) -> Iterator[None]:
    """Prepend the name of a file to errors about it."""
    try:
        yield
    except FpmatchError as error:
        raise type(error)(f"{source}: {error}") from error
    except MemoryError as error:
        raise ImageError(f"{source}: image is too large for this machine's memory") from error


def sniff(head: bytes) -> ImageReader | None:
    """Return the reader of a file that begins like this; None where there is none."""
    return next((reader for reader in READERS if head.startswith(reader.signatures)), None)


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

"""Read image files as 8-bit grey images; the format is found by content, never by name."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.parsing import read_regular
from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.grey import (
    DEFAULT_LIMITS,
    FEWEST_RAW_BYTES,
    GreyImage,
    ImageLimits,
    decode_raw,
    grey_image,
    likely_raw_size,
)
from fpmatch.image.io.pillow_formats import convert_opened
from fpmatch.image.io.registry import other_kind, sniff
from fpmatch.image.quality.polarity import INVERTED, check_polarity, is_inverted
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity

__all__ = ["GreyImage", "ImageLimits", "decode_image", "read_image"]

_NO_IMAGES: Final = ("a folder, not an image", "not a regular file, not an image")


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
        image = replace(_decode(data, limits, raw_sizes, record), source=source)
    return _settled(image, polarity, dpi)


def _settled(image: GreyImage, polarity: Polarity, dpi: float | None) -> GreyImage:
    """Return an image with dark ridges, without a resolution that its ridges contradict."""
    if image.dpi is not None and dpi is None:
        from fpmatch.image.quality.ridge_scale import contradiction  # noqa: PLC0415

        if why := contradiction(image.pixels, image.dpi):
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


def _decode(
    data: bytes, limits: ImageLimits, raw_sizes: Sequence[RawSize], record: int | None
) -> GreyImage:
    for size in raw_sizes:
        if size.bits(len(data)):
            return decode_raw(data, size, limits)
    reader = sniff(data)
    if reader is not None:
        return reader.decode(data, limits, *((record,) if reader.holds_several else ()))
    kind = other_kind(data)
    why = "not an image of a known format" + (f" ({kind})" if kind else "")
    if raw_sizes:
        sizes = ", ".join(f"{size} ({size.bytes})" for size in raw_sizes)
        why += f"; its {len(data)} bytes are no raw {sizes}"
    elif not (kind or data.isascii() or len(data) < FEWEST_RAW_BYTES):
        likely = likely_raw_size(data)
        bits = likely.bits(len(data)) if likely else 8
        packed = "" if bits == 8 else f" ({bits} bits a pixel)"
        why += f"; if its {len(data)} bytes are pixels: --raw {likely or 'WIDTHxHEIGHT'}{packed}"
    raise ImageReadError(why)

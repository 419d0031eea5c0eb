"""Read image files as 8-bit grey images.

The format of a file is found by its content, never by its name, among the formats that
fingerprint images come in; see `fpmatch.image.io.registry`.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.grey import as_grey
from fpmatch.image.io.limits import DEFAULT_LIMITS, ImageLimits
from fpmatch.image.io.pillow_formats import in_words
from fpmatch.image.io.raw import decode_raw, raw_size_of
from fpmatch.image.io.registry import reader_of
from fpmatch.image.quality.polarity import INVERTED, check_polarity, is_inverted
from fpmatch.minutiae import STANDARD_DPI, check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.image.io.byte_reader import Picture
    from fpmatch.image.io.raw import RawSize
    from fpmatch.image.quality.polarity import Polarity

__all__ = ["GreyImage", "ImageLimits", "as_grey", "decode_image", "read_image"]


@dataclass(frozen=True, slots=True, eq=False)
class GreyImage:
    """Hold one impression as it was read.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W)
        Grey values, 0 black to 255 white.
    dpi : float or None
        Resolution in dots per inch; None where the file does not tell.
    source : str
        Where the image came from, for messages: a path, or ``"array"``.
    format : str
        Name of the file's format, for people; "" where there was no file.
    notes : tuple of str
        What was done or noticed on reading, in words that follow the source: that white ridges
        were turned into dark ones, say.

    Raises
    ------
    ImageError
        If `pixels` is not two-dimensional uint8, or empty.
    ResolutionError
        If `dpi` lies outside 100 to 4000.
    """

    pixels: NDArray[np.uint8] = field(repr=False)
    dpi: float | None = None
    source: str = "array"
    format: str = field(default="", repr=False)
    notes: tuple[str, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if self.pixels.ndim != 2 or self.pixels.dtype != np.uint8:
            raise ImageError(f"{self.source}: pixels must be a two-dimensional array of uint8")
        if self.pixels.size == 0:
            raise ImageError(f"{self.source}: an image must have pixels")
        if self.dpi is not None:
            object.__setattr__(self, "dpi", check_dpi(self.dpi))


def read_image(
    path: str | os.PathLike[str],
    *,
    limits: ImageLimits = DEFAULT_LIMITS,
    raw_sizes: Sequence[RawSize] = (),
    polarity: Polarity = "auto",
    dpi: float | None = None,
) -> GreyImage:
    """Read an image file as grey values with its resolution.

    Parameters
    ----------
    path : path-like
        A TIFF, PNG, BMP, JPEG, PGM/PPM/PBM, GIF, WebP, JPEG 2000 or WSQ file of 1, 8, 16 or 32
        bits a sample; grey, palette or colour; or a record that holds one, of ANSI/NIST-ITL (AN2),
        ISO/IEC 19794-4 or ANSI 381. Transparent pixels are laid over white; of a file with several
        pictures the first is read.
    limits : ImageLimits
        Sizes that are refused, before reading and decoding.
    raw_sizes : sequence of RawSize
        Sizes in pixels of files without a header: a file of as many bytes as one of them has
        pixels is taken for those.
    polarity : str
        "dark": the grey values stay as they are; "white": they are inverted; "auto": they are
        where the print surely shows white ridges.
    dpi : float, optional
        Resolution at which that is looked at; by default what the file says, and 500 where it says
        nothing.

    Returns
    -------
    GreyImage
        `dpi` is None unless the file names one value for both axes above 100 and up to 4000 dpi;
        lower ones are what programs write that do not know (1, 72, 96).

    Raises
    ------
    ImageReadError
        If the file is missing, empty, damaged, or not an image.
    ImageError
        If the picture is too small or too large, its values make no grey image, or there is no
        such polarity.

    Examples
    --------
    >>> import tempfile
    >>> from PIL import Image
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "print.png")
    ...     Image.new("L", (64, 80), 200).save(path, dpi=(500, 500))
    ...     image = read_image(path)
    >>> image.pixels.shape, image.dpi
    ((80, 64), 500.0)
    """
    with _naming(path):
        data = _bytes_of(path, limits)
    return decode_image(
        data, str(path), limits=limits, raw_sizes=raw_sizes, polarity=polarity, dpi=dpi
    )


def decode_image(
    data: bytes,
    source: str,
    *,
    limits: ImageLimits = DEFAULT_LIMITS,
    raw_sizes: Sequence[RawSize] = (),
    polarity: Polarity = "auto",
    dpi: float | None = None,
) -> GreyImage:
    """Make a grey image of the bytes of an image file, as `read_image` does of the file.

    Parameters
    ----------
    data : bytes
        The whole file.
    source : str
        What it is called in messages.
    limits, raw_sizes, polarity, dpi
        As for `read_image`.

    Returns
    -------
    GreyImage
        The image.

    Raises
    ------
    ImageReadError, ImageError
        As `read_image` does.

    Examples
    --------
    >>> decode_image(b"P5 60 50 255 " + bytes(3000), "print.pgm").pixels.shape
    (50, 60)
    """
    with _naming(source):
        if len(data) > limits.max_file_megabytes * 1e6:
            raise ImageReadError(f"the file is larger than {limits.max_file_megabytes:g} MB")
        if not data:
            raise ImageReadError("the file is empty")
        picture = _decode(data, limits, raw_sizes)
    pixels, notes = picture.pixels, picture.notes
    if check_polarity(polarity) == "auto":
        white = is_inverted(pixels, dpi or picture.dpi or STANDARD_DPI)
    else:
        white = polarity == "white"
    if white:
        pixels, notes = 255 - pixels, (*notes, INVERTED)
    return GreyImage(pixels, picture.dpi, source, picture.format, notes)


@contextmanager
def _naming(source: object) -> Iterator[None]:
    """Put the name of a file before what is said of it."""
    try:
        yield
    except FpmatchError as error:
        raise type(error)(f"{source}: {error}") from error
    except MemoryError as error:
        raise ImageError(f"{source}: image is too large for this machine's memory") from error


def _decode(data: bytes, limits: ImageLimits, raw_sizes: Sequence[RawSize]) -> Picture:
    size = raw_size_of(len(data), raw_sizes)
    if size is not None:
        return decode_raw(data, size, limits)
    try:
        reader = reader_of(data)
    except ImageReadError as error:
        if not raw_sizes:
            raise
        sizes = ", ".join(f"{size} ({size.bytes})" for size in raw_sizes)
        raise ImageReadError(f"{error}; its {len(data)} bytes are no raw {sizes}") from error
    return reader.decode(data, limits)


def _bytes_of(path: str | os.PathLike[str], limits: ImageLimits) -> bytes:
    """Return the bytes of the regular file at `path`, or one more than may be."""
    most = int(limits.max_file_megabytes * 1e6)
    try:
        if not Path(path).exists():
            raise ImageReadError("no such file")
        if not Path(path).is_file():
            kind = "a folder" if Path(path).is_dir() else "not a regular file"
            raise ImageReadError(f"is {kind}, not an image")
        with Path(path).open("rb") as stream:
            data = stream.read(most + 1)
    except (OSError, ValueError) as error:
        raise ImageReadError(in_words(error)) from error
    return data

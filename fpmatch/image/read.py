"""Read image files and user arrays as 8-bit grey images.

The format of a file is found by its content, never by its name, among the raster formats that
fingerprint images come in. The list is closed on purpose: Pillow knows others that start outside
programs to decode a file.
"""

from __future__ import annotations

import threading
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image, UnidentifiedImageError

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.minutiae import MAX_DPI, MIN_DPI, check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

# First bytes of a file and the name of Pillow's decoder for it.
SIGNATURES: Final = (
    (b"II*\x00", "TIFF"),
    (b"MM\x00*", "TIFF"),
    (b"II+\x00", "TIFF"),
    (b"MM\x00+", "TIFF"),
    (b"\x89PNG\r\n\x1a\n", "PNG"),
    (b"BM", "BMP"),
    (b"\xff\xd8\xff", "JPEG"),
    *((b"P%d" % digit, "PPM") for digit in range(1, 7)),
    (b"GIF8", "GIF"),
    (b"RIFF", "WEBP"),
    (b"\x00\x00\x00\x0cjP  ", "JPEG2000"),
    (b"\xff\x4f\xff\x51", "JPEG2000"),
)
LUMA: Final = (0.299, 0.587, 0.114)  # weights of red, green and blue, ITU-R BT.601
TAGGED_DPI_DIGITS: Final = 1  # 500 dpi in a tag per metre comes back as 499.999
TIFF_BITS_PER_SAMPLE: Final = 258
TIFF_PHOTOMETRIC: Final = 262
TIFF_WHITE_IS_ZERO: Final = 0

_warnings_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class ImageLimits:
    """Bound the size of an image that is taken for a fingerprint.

    Parameters
    ----------
    min_side_px : int
        Shortest side; below it not one ridge neighbourhood fits in.
    max_side_px : int
        Longest side.
    max_megapixels : float
        Largest area in millions of pixels, checked before a pixel is decoded. Files above
        Pillow's own limit (89 megapixels) are refused whatever stands here.
    """

    min_side_px: int = 48
    max_side_px: int = 10_000
    max_megapixels: float = 64.0

    def check(self, width: int, height: int) -> None:
        """Raise ImageError unless an image of `width` x `height` pixels keeps the limits."""
        size = f"image of {width} x {height} pixels"
        if min(width, height) < self.min_side_px:
            raise ImageError(
                f"{size} is smaller than one ridge neighbourhood "
                f"({self.min_side_px} x {self.min_side_px})"
            )
        if max(width, height) > self.max_side_px:
            raise ImageError(f"{size} is too large: a side may have {self.max_side_px} pixels")
        if width * height > self.max_megapixels * 1e6:
            raise ImageError(f"{size} is too large: more than {self.max_megapixels:g} megapixels")


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

    def __post_init__(self) -> None:
        if self.pixels.ndim != 2 or self.pixels.dtype != np.uint8:
            raise ImageError(f"{self.source}: pixels must be a two-dimensional array of uint8")
        if self.pixels.size == 0:
            raise ImageError(f"{self.source}: an image must have pixels")
        if self.dpi is not None:
            object.__setattr__(self, "dpi", check_dpi(self.dpi))


def read_image(path: str | os.PathLike[str], *, limits: ImageLimits = ImageLimits()) -> GreyImage:
    """Read an image file as grey values with its resolution.

    Parameters
    ----------
    path : path-like
        A TIFF, PNG, BMP, JPEG, PGM/PPM/PBM, GIF, WebP or JPEG 2000 file of 1, 8 or 16 bits a
        sample; grey, palette or colour. Transparent pixels are laid over white; of a file with
        several pictures the first is read.
    limits : ImageLimits
        Sizes that are refused, before decoding.

    Returns
    -------
    GreyImage
        `dpi` is None unless the file's tag names one value for both axes above 100 and up to
        4000 dpi; lower ones are what programs write that do not know (1, 72, 96).

    Raises
    ------
    ImageReadError
        If the file is missing, empty, damaged, or not an image.
    ImageError
        If the picture is too small or too large, or its values make no grey image.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "print.png")
    ...     Image.new("L", (64, 80), 200).save(path, dpi=(500, 500))
    ...     image = read_image(path)
    >>> image.pixels.shape, image.dpi
    ((80, 64), 500.0)
    """
    decoder = _decoder_of(path)
    try:
        with _decoder_warnings_held(), Image.open(path, formats=[decoder]) as picture:
            limits.check(*picture.size)
            dpi = _tagged_dpi(picture)
            pixels = as_grey(_samples(picture), limits=limits)
    except FpmatchError as error:
        raise type(error)(f"{path}: {error}") from error
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise ImageError(
            f"{path}: image is too large: more than {limits.max_megapixels:g} megapixels"
        ) from error
    except UnidentifiedImageError as error:
        raise ImageReadError(
            f"{path}: damaged {decoder} image (its header cannot be read)"
        ) from error
    except Exception as error:  # decoders of a damaged file raise almost anything
        raise ImageReadError(f"{path}: damaged {decoder} image ({_in_words(error)})") from error
    return GreyImage(pixels, dpi, str(path))


def as_grey(array: ArrayLike, *, limits: ImageLimits = ImageLimits()) -> NDArray[np.uint8]:
    """Return an array of pixels as 8-bit grey values.

    Parameters
    ----------
    array : array_like, shape (H, W), (H, W, 1), (H, W, 3) or (H, W, 4)
        Grey, RGB or RGBA; transparent pixels are laid over white. Booleans are black and white;
        uint8 is taken as it is; uint16 spans 0..65535; other integers span 0..255 if none is
        larger, else 0..65535; floats span 0..1 if none is larger, else 0..255.
    limits : ImageLimits
        Sizes that are refused.

    Returns
    -------
    ndarray of uint8, shape (H, W)
        Contiguous; `array` itself where it already is that.

    Raises
    ------
    ImageError
        If the shape or the type is none of these, a value is not finite or leaves its span, or
        the size breaks a limit.

    Examples
    --------
    >>> as_grey(np.full((64, 64), 0.5)).max()
    np.uint8(128)
    """
    try:
        values = np.asarray(array)
    except ValueError as error:
        raise ImageError("an image must be an array of numbers") from error
    if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] not in (1, 3, 4)):
        raise ImageError(
            f"an image must have shape (H, W), (H, W, 3) or (H, W, 4), not {values.shape}"
        )
    limits.check(values.shape[1], values.shape[0])
    eight_bit = _eight_bit(values)
    if eight_bit.ndim == 3:
        eight_bit = _luma(eight_bit)
    return np.ascontiguousarray(eight_bit)


def _decoder_of(path: str | os.PathLike[str]) -> str:
    """Return the name of Pillow's decoder for the file at `path`, by its first bytes."""
    try:
        if not Path(path).exists():
            raise ImageReadError(f"{path}: no such file")
        if not Path(path).is_file():
            kind = "a folder" if Path(path).is_dir() else "not a regular file"
            raise ImageReadError(f"{path}: is {kind}, not an image")
        with Path(path).open("rb") as stream:
            head = stream.read(16)
    except (OSError, ValueError) as error:
        raise ImageReadError(f"{path}: {_in_words(error)}") from error
    if not head:
        raise ImageReadError(f"{path}: the file is empty")
    for signature, decoder in SIGNATURES:
        if head.startswith(signature):
            return decoder
    raise ImageReadError(f"{path}: not an image of a known format")


@contextmanager
def _decoder_warnings_held() -> Iterator[None]:
    """Keep Pillow's warnings from the user; its warning of a huge image becomes an error.

    Python's warning filters are global to the process, so one thread at a time changes them.
    """
    with _warnings_lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        yield


def _samples(picture: Image.Image) -> NDArray[Any]:
    """Return the picture's samples in a type that says their span, grey, RGB or RGBA."""
    if picture.mode.startswith("I;16"):
        return _sixteen_bit_samples(picture)
    if picture.mode in {"1", "L", "I", "F"} and not picture.has_transparency_data:
        return np.asarray(picture)
    return np.asarray(picture.convert("RGBA" if picture.has_transparency_data else "RGB"))


def _sixteen_bit_samples(picture: Image.Image) -> NDArray[np.uint16]:
    """Return samples of 9 to 16 bits on the span 0..65535, black at 0."""
    tags = getattr(picture, "tag_v2", {})
    bits = int(tags.get(TIFF_BITS_PER_SAMPLE, (16,))[0])
    samples = np.asarray(picture).astype(np.uint16)
    if bits < 16:
        largest = 2**bits - 1
        scaled = np.minimum(samples, largest).astype(np.uint32) * 0xFFFF // largest
        samples = scaled.astype(np.uint16)
    if tags.get(TIFF_PHOTOMETRIC) == TIFF_WHITE_IS_ZERO:
        samples = np.uint16(0xFFFF) - samples
    return samples


def _tagged_dpi(picture: Image.Image) -> float | None:
    """Return the resolution that the file's tag names, None where it names no usable one."""
    try:
        horizontal, vertical = (
            round(float(value), TAGGED_DPI_DIGITS) for value in picture.info["dpi"]
        )
    except (KeyError, TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return horizontal if horizontal == vertical and MIN_DPI < horizontal <= MAX_DPI else None


def _eight_bit(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Scale `values` of any numeric type to 0..255."""
    if values.dtype == np.uint8:
        return values
    if values.dtype == np.bool_:
        return np.where(values, np.uint8(255), np.uint8(0))
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise ImageError("an image must not hold NaN or infinite values")
    if values.dtype.kind not in "iuf":
        raise ImageError(f"an image must hold numbers, not {values.dtype}")
    is_float = values.dtype.kind == "f"
    span = _span(float(values.max()), is_float=is_float, is_uint16=values.dtype.char == "H")
    if values.min() < 0 or values.max() > span:
        raise ImageError(
            f"pixel values run from {values.min():g} to {values.max():g}, outside 0 to {span:g}"
        )
    scaled: NDArray[np.uint8] = np.rint(values.astype(np.float32) * (255.0 / span)).astype(np.uint8)
    return scaled


def _span(largest: float, *, is_float: bool, is_uint16: bool) -> float:
    """Return the value that means white, as `as_grey` documents it."""
    if is_uint16:
        return 65535.0
    if is_float:
        return 1.0 if largest <= 1.0 else 255.0
    return 255.0 if largest <= 255 else 65535.0


def _luma(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the brightness of grey, RGB or RGBA pixels, shape (H, W, 1, 3 or 4), over white."""
    if colours.shape[2] == 1:
        return colours[..., 0]
    grey = colours[..., :3].astype(np.float32) @ np.array(LUMA, dtype=np.float32)
    if colours.shape[2] == 4:
        opacity = colours[..., 3].astype(np.float32) / 255.0
        grey = grey * opacity + 255.0 * (1.0 - opacity)
    luma: NDArray[np.uint8] = np.rint(grey).astype(np.uint8)
    return luma


def _in_words(error: Exception) -> str:
    """Return the reason that an exception gives, on one line."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(reason.split()) or type(error).__name__

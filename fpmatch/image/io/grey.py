"""`GreyImage`, of samples of any type and colour or of bare pixels, and the limits of its size."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.image.preprocess.arrays import Grey

_SENSORS: Final = (  # sizes of well-known sensors, width and height
    *((388, 374), (296, 560), (288, 384), (640, 480), (328, 364), (300, 480), (256, 364)),
    *((448, 478), (240, 320), (400, 560), (152, 200)),
)
_LEAST_SQUARE: Final = 96  # pixels; files of fewer bytes may be anything
_SIZE: Final = re.compile(r"([1-9]\d{0,5})[x×X]([1-9]\d{0,5})", re.ASCII)
LUMA: Final = (0.299, 0.587, 0.114)  # weights of red, green and blue, ITU-R BT.601
_BAND_SAMPLES: Final = 4_000_000  # converted at a time, so that memory does not grow with the image
_MAX_INVISIBLE: Final = 3  # grey levels between all pixels of an image without content
ON_WHITE: Final = "its transparent background was composed over white"
ON_BLACK: Final = (
    "its transparent background was composed over black, as nothing is visible over white"
)
ALL_TRANSPARENT: Final = "its transparency was ignored: every pixel is fully transparent"


@dataclass(frozen=True, slots=True)
class ImageLimits:
    """Bound the size of an image that is taken for a fingerprint."""

    min_side_px: int = 48  # holds one ridge neighbourhood
    max_side_px: int = 10_000
    max_megapixels: float = 64.0  # checked before decoding; Pillow refuses more than 89 in any case
    max_file_megabytes: float = 256.0  # checked before reading

    def check(self, width: int, height: int, *, max_megapixels: float | None = None) -> None:
        """Raise ImageError if the size breaks a limit; a format may have a smaller area limit."""
        size = f"image of {width} x {height} pixels"
        megapixels = min(self.max_megapixels, max_megapixels or self.max_megapixels)
        if min(width, height) < self.min_side_px:
            least = f"{self.min_side_px} x {self.min_side_px}"
            raise ImageError(f"{size} is smaller than one ridge neighbourhood ({least})")
        if max(width, height) > self.max_side_px:
            raise ImageError(f"{size} is too large: a side may have {self.max_side_px} pixels")
        if width * height > megapixels * 1e6:
            raise ImageError(f"{size} is too large: more than {megapixels:g} megapixels")


DEFAULT_LIMITS: Final = ImageLimits()


@dataclass(frozen=True, slots=True, eq=False)
class GreyImage:
    """One impression as it was read.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W)
        Grey values, 0 black to 255 white.
    dpi : float or None
        Resolution in dots per inch; None where it is unknown.
    source : str
        Path of the file, or ``"array"``; errors start with it.
    format : str
        Name of the file format; "" where there was no file.
    notes : tuple of str
        What reading changed or assumed, such as inverted grey values.
    likely_dpi : float or None
        Resolution by the ridges of the prints that came with this one, where `dpi` is None.

    Raises
    ------
    ImageError
        If `pixels` is not two-dimensional uint8, or empty.
    ResolutionError
        If `dpi` lies outside 100 to 4000.
    """

    pixels: Grey = field(repr=False)
    dpi: float | None = None
    source: str = "array"
    format: str = field(default="", repr=False)
    notes: tuple[str, ...] = field(default=(), repr=False)
    likely_dpi: float | None = None

    def __post_init__(self) -> None:
        if self.pixels.ndim != 2 or self.pixels.dtype != np.uint8:
            raise ImageError(f"{self.source}: pixels must be a two-dimensional array of uint8")
        if self.pixels.size == 0:
            raise ImageError(f"{self.source}: an image must have pixels")
        if self.dpi is not None:
            object.__setattr__(self, "dpi", check_dpi(self.dpi))


def with_square_pixels(
    image: GreyImage, axes: tuple[float, float] | None, limits: ImageLimits = DEFAULT_LIMITS
) -> GreyImage:
    """Return an image with its resolution across and down, resampled to the higher if they differ.

    Raises ImageError if it is then larger than the limits.
    """
    if axes is None or axes[0] == axes[1]:
        return replace(image, dpi=None if axes is None else axes[0])
    import cv2  # noqa: PLC0415

    dpi = max(axes)
    height, width = image.pixels.shape
    size = round(width * dpi / axes[0]), round(height * dpi / axes[1])
    limits.check(*size)
    pixels = cv2.resize(image.pixels, size, interpolation=cv2.INTER_CUBIC)
    note = f"its resolution is {axes[0]:g} dpi across and {axes[1]:g} down: resampled to {dpi:g}"
    return replace(image, pixels=np.asarray(pixels, np.uint8), dpi=dpi, notes=(*image.notes, note))


def as_grey(array: ArrayLike, *, limits: ImageLimits = DEFAULT_LIMITS) -> Grey:
    """Return an array of pixels as 8-bit grey values (H, W): contiguous, or the array itself.

    The array is grey, (H, W) or (H, W, 1), RGB or RGBA; transparent pixels are composed over white.
    Black to white is False to True, 0..255 for uint8 and 0..65535 for uint16; other integers span
    0..255 if none is larger, else 0..65535; floats span 0..1 if none is larger, else 0..255.

    Raises ImageError if the shape or the type is none of these, a value is not finite or leaves its
    span, or the size breaks a limit.
    """
    try:
        values = np.asarray(array)
    except ValueError as error:
        raise ImageError("an image must be an array of numbers") from error
    if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] not in (1, 3, 4)):
        shapes = "(H, W), (H, W, 3) or (H, W, 4)"
        raise ImageError(f"an image must have shape {shapes}, not {values.shape}")
    limits.check(values.shape[1], values.shape[0])
    eight_bit = _eight_bit(values)
    if eight_bit.ndim == 3:
        eight_bit = _over(eight_bit, 255)
    return np.ascontiguousarray(eight_bit)


def flatten_transparency(colours: Grey) -> tuple[Grey, tuple[str, ...]]:
    """Return RGBA values (H, W, 4) as grey values, and notes on what became of transparency.

    They are composed over white, or over black where nothing shows over white; transparency is
    ignored where every pixel is fully transparent.
    """
    opacity = colours[..., 3]
    if opacity.min() == 255:
        return _over(colours[..., :3], 255), ()
    if opacity.max() == 0:
        return _over(colours[..., :3], 255), (ALL_TRANSPARENT,)
    on_white = _over(colours, 255)
    if int(on_white.max()) - int(on_white.min()) > _MAX_INVISIBLE:
        return on_white, (ON_WHITE,)
    return _over(colours, 0), (ON_BLACK,)


def _eight_bit(values: NDArray[Any]) -> Grey:
    """Scale `values` of any numeric type to 0..255."""
    if values.dtype == np.uint8:
        return values
    if values.dtype == np.bool_:
        return np.where(values, np.uint8(255), np.uint8(0))
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise ImageError("an image must not hold NaN or infinite values")
    if values.dtype.kind not in "iuf":
        raise ImageError(f"an image must hold numbers, not {values.dtype}")
    narrow, wide = (1.0, 255.0) if values.dtype.kind == "f" else (255.0, 65535.0)
    span = narrow if values.max() <= narrow and values.dtype.char != "H" else wide
    if values.min() < 0 or values.max() > span:
        given = f"pixel values run from {values.min():g} to {values.max():g}"
        raise ImageError(f"{given}, outside 0 to {span:g}")
    scaled = np.empty(values.shape, np.uint8)
    for rows in _bands(values.shape):
        scaled[rows] = np.rint(values[rows].astype(np.float32) * (255.0 / span))
    return scaled


def _over(colours: Grey, ground: int) -> Grey:
    """Return the brightness of grey, RGB or RGBA pixels, shape (H, W, 1, 3 or 4), over `ground`."""
    if colours.shape[2] == 1:
        return colours[..., 0]
    luma = np.empty(colours.shape[:2], np.uint8)
    for rows in _bands(colours.shape):
        band = colours[rows]
        grey = band[..., :3].astype(np.float32) @ np.array(LUMA, dtype=np.float32)
        if colours.shape[2] == 4:
            opacity = band[..., 3].astype(np.float32) / 255.0
            grey = grey * opacity + ground * (1.0 - opacity)
        luma[rows] = np.rint(grey)
    return luma


def _bands(shape: tuple[int, ...]) -> list[slice]:
    """Return slices of rows that hold a bounded number of samples each."""
    rows = max(1, _BAND_SAMPLES // max(1, int(np.prod(shape[1:]))))
    return [slice(start, start + rows) for start in range(0, shape[0], rows)]


@dataclass(frozen=True, slots=True)
class RawSize:
    """The positive size of an image whose file is its pixels, row by row, 8 bits each."""

    width: int
    height: int

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ImageError(f"a size must be positive, not {self}")

    @property
    def bytes(self) -> int:
        """Number of bytes of the file."""
        return self.width * self.height

    @classmethod
    def parse(cls, text: str) -> RawSize:
        """Return the size that ``WIDTHxHEIGHT`` names; raise ImageError for other text."""
        size = _SIZE.fullmatch(text.strip())
        if size is None:
            raise ImageError(f"a size is written WIDTHxHEIGHT, as in 388x374, not {text!r}")
        return cls(int(size[1]), int(size[2]))

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


def likely_raw_size(data: bytes) -> RawSize | None:
    """Return the size of a well-known sensor, or the square, of as many pixels; else None."""
    side = math.isqrt(len(data))
    square = [(side, side)] if side >= _LEAST_SQUARE else []
    fits = (size for size in (*_SENSORS, *square) if size[0] * size[1] == len(data))
    size = next(fits, None)
    return size and RawSize(*size)


def decode_raw(data: bytes, size: RawSize, limits: ImageLimits) -> GreyImage:
    """Return `data` as the pixels of an image of `size`; raise ImageError if they do not fit."""
    limits.check(size.width, size.height)
    if len(data) != size.bytes:
        raise ImageError(f"{len(data)} bytes are no {size} pixels of 8 bits")
    pixels = np.frombuffer(data, np.uint8).reshape(size.height, size.width)
    return GreyImage(pixels.copy(), format="raw")

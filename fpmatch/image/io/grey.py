"""`GreyImage`, of samples of any type and colour or of bare pixels; limits of size; resolution."""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.preprocess.arrays import percentiles
from fpmatch.templates.bounds import MOST_MEGAPIXELS, most_megapixels
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, STANDARD_DPI, check_dpi, dpi_of_per_cm

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.image.preprocess.arrays import Grey

_BITS: Final = (8, 4, 2, 1)  # of a pixel in a file without a header
_SIZE: Final = re.compile(r"([1-9]\d{0,5})[x×X]([1-9]\d{0,5})", re.ASCII)
_BAND_SAMPLES: Final = 4_000_000  # converted at a time, so that memory does not grow with the image
_LEAST_USED: Final = 0.25  # of the range of a type; what uses less of it is stretched
_FEW_PERCENT: Final = 0.1  # of the samples, darker and brighter than the range that is used
_MOST_COUNTED: Final = 1_000_000  # samples
_CLEARLY_MORE: Final = 1.25  # times the contrast, over black
_EQUAL: Final = 0.01  # relative difference of two axes of one resolution
# What a value, or a damaged tag, raises that is no number.
UNREADABLE: Final = (
    *(ArithmeticError, AttributeError, LookupError, OSError, SyntaxError, TypeError, ValueError),
    struct.error,
)
ON_WHITE: Final = "its transparent background was composed over white"
ON_BLACK: Final = (
    "its transparent background was composed over black, where it has more contrast than over white"
)
ALL_TRANSPARENT: Final = "its transparency was ignored: every pixel is fully transparent"


@dataclass(frozen=True, slots=True)
class ImageLimits:
    """Bound the size of an image that is taken for a fingerprint."""

    min_side_px: int = 48  # holds one ridge neighbourhood
    max_side_px: int = 10_000
    max_megapixels: float = MOST_MEGAPIXELS  # checked before decoding
    max_file_megabytes: float = 256.0  # checked before reading
    dpi: float | None = None  # of the image, where it is known before its file is opened

    def check(
        self, width: int, height: int, dpi: float | None = None, *, most: float = MOST_MEGAPIXELS
    ) -> None:
        """Raise ImageError if the size breaks a limit, at its file's own resolution or at 500 dpi.

        A format may have a smaller area, `most` megapixels.
        """
        size = f"image of {width} x {height} pixels"
        known = self.dpi or dpi
        at_dpi = most_megapixels(known or STANDARD_DPI)
        megapixels = min(self.max_megapixels, most, at_dpi)
        if min(width, height) < self.min_side_px:
            least = f"{self.min_side_px} x {self.min_side_px}"
            raise ImageError(f"{size} is smaller than one ridge neighbourhood ({least})")
        if max(width, height) > self.max_side_px:
            raise ImageError(f"{size} is too large: a side may have {self.max_side_px} pixels")
        if width * height > megapixels * 1e6:
            where = f" at {known:g} dpi" if known else ", as its file states no resolution (--dpi)"
            why = f"more than {megapixels:.3g} megapixels{where if megapixels == at_dpi else ''}"
            raise ImageError(f"{size} is too large: {why}")


DEFAULT_LIMITS: Final = ImageLimits()
FEWEST_RAW_BYTES: Final = DEFAULT_LIMITS.min_side_px**2 // 2  # of an image of 4 bits a pixel


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


def usable_dpi(value: object) -> float | None:
    """Return the resolution of both axes in dpi; see `usable_axes`."""
    axes = usable_axes(value, value)
    return axes and axes[0]


def usable_axes(horizontal: object, vertical: object) -> tuple[float, float] | None:
    """Return a file's resolution across and down in dpi, rounded to a tenth, or None.

    Axes that differ by 1 % or less have the horizontal one. None where a value is not above 100 and
    up to 4000 dpi: lower ones (1, 72, 96) are defaults of programs.

    Examples
    --------
    >>> usable_axes(569, 570), usable_axes(500, 357), usable_axes(72, 500)
    ((569.0, 569.0), (500.0, 357.0), None)
    """
    try:  # 500 dpi per metre are 499.999
        across, down = (round(float(value), 1) for value in (horizontal, vertical))  # type: ignore[arg-type]
    except UNREADABLE:
        return None
    if not (MIN_DPI < across <= MAX_DPI and MIN_DPI < down <= MAX_DPI):
        return None
    equal = abs(across - down) <= _EQUAL * max(across, down)
    return across, across if equal else down


def dpi_in_units(units: int, pixels: float) -> float | None:
    """Return the resolution of a record in dpi, of a code of the units and whole pixels a unit.

    The code is that of ANSI/NIST-ITL and ISO/IEC 19794-4: 1 for pixels per inch, 2 per centimetre.
    """
    if units not in {1, 2}:
        return None
    return usable_dpi(pixels if units == 1 else dpi_of_per_cm(pixels))


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
    limits.check(*size, dpi)
    pixels = cv2.resize(image.pixels, size, interpolation=cv2.INTER_CUBIC)
    note = f"its resolution is {axes[0]:g} dpi across and {axes[1]:g} down: resampled to {dpi:g}"
    return replace(image, pixels=np.asarray(pixels, np.uint8), dpi=dpi, notes=(*image.notes, note))


def grey_image(
    array: ArrayLike,
    *,
    format: str = "",  # noqa: A002  (the name of the field)
    notes: tuple[str, ...] = (),
    limits: ImageLimits = DEFAULT_LIMITS,
) -> GreyImage:
    """Return an array of pixels as an image of 8-bit grey values, contiguous or the array itself.

    The array is grey, (H, W) or (H, W, 1), RGB or RGBA. Black to white is False to True, and 0..255
    for uint8. Other integers span 0..255 if none is larger, else 0..65535; floats span the first of
    0..1, 0..255 and 0..65535 that holds them. Values that leave all spans, or use less than a
    quarter of theirs (but for integers of 0..255), are stretched: the range of all but the highest
    and lowest thousandth becomes 0..255. Transparent pixels are composed over white, or over black
    where the image then has clearly more contrast. Notes say what was done.

    Raises ImageError if the shape or the type is none of these, a value is not finite, all values
    are one outside of 0..65535, RGBA values leave all spans, or the size breaks a limit.
    """
    try:
        values = np.asarray(array)
    except ValueError as error:
        raise ImageError("an image must be an array of numbers") from error
    if values.ndim not in (2, 3) or (values.ndim == 3 and values.shape[2] not in (1, 3, 4)):
        shapes = "(H, W), (H, W, 3) or (H, W, 4)"
        raise ImageError(f"an image must have shape {shapes}, not {values.shape}")
    limits.check(values.shape[1], values.shape[0], MAX_DPI)  # it is in memory already
    if values.dtype != np.uint8:
        values, more = _eight_bit(values)
        notes += more
    if values.ndim == 3 and values.shape[2] == 4:
        values, more = _flattened(values)
        notes += more
    elif values.ndim == 3:
        values = _over(values, 255)
    return GreyImage(np.ascontiguousarray(values), format=format, notes=notes)


def _flattened(colours: Grey) -> tuple[Grey, tuple[str, ...]]:
    """Return RGBA values (H, W, 4) as grey values, and notes on what became of transparency.

    Transparency is ignored where every pixel is fully transparent.
    """
    opacity = colours[..., 3]
    if opacity.min() == 255:
        return _over(colours[..., :3], 255), ()
    if opacity.max() == 0:
        return _over(colours[..., :3], 255), (ALL_TRANSPARENT,)
    on_white, on_black = _over(colours, 255), _over(colours, 0)
    if _steps(on_black) > _CLEARLY_MORE * _steps(on_white):
        return on_black, (ON_BLACK,)
    return on_white, (ON_WHITE,)


def _steps(grey: Grey) -> float:
    """Return the mean difference of pixels from their neighbours, below and beside."""
    pairs = (grey[1:], grey[:-1]), (grey[:, 1:], grey[:, :-1])
    return sum(float((np.maximum(a, b) - np.minimum(a, b)).mean()) for a, b in pairs)


def _over(colours: Grey, ground: int) -> Grey:
    """Return the brightness of pixels (H, W, 1, 3 or 4) over a black (0) or white (255) ground."""
    if colours.shape[2] == 1:
        return colours[..., 0]
    import cv2  # noqa: PLC0415

    grey = cv2.cvtColor(np.ascontiguousarray(colours[..., :3]), cv2.COLOR_RGB2GRAY)
    if colours.shape[2] == 4:
        opacity = np.ascontiguousarray(colours[..., 3])
        grey = cv2.multiply(grey, opacity, scale=1 / 255)
        grey = cv2.add(grey, 255 - opacity) if ground else grey
    return np.asarray(grey, np.uint8)


def _eight_bit(values: NDArray[Any]) -> tuple[Grey, tuple[str, ...]]:
    """Scale `values` of another type to 0..255; a note says what the type does not."""
    if values.dtype == np.bool_:
        return np.where(values, np.uint8(255), np.uint8(0)), ()
    is_float = values.dtype.kind == "f"
    if is_float and not np.isfinite(values).all():
        raise ImageError("an image must not hold NaN or infinite values")
    if values.dtype.kind not in "iuf":
        raise ImageError(f"an image must hold numbers, not {values.dtype}")
    low, high = float(values.min()), float(values.max())
    narrow, wide = (1.0, 255.0) if is_float else (255.0, 65535.0)
    span = narrow if high <= narrow else wide
    inside = low >= 0 and high <= span
    is_byte = inside and span == narrow and not is_float
    may_stretch = not (is_byte or values.shape[2:] == (4,))
    black, white = 0.0, span
    if may_stretch:
        step = math.isqrt(values.size // _MOST_COUNTED) + 1
        few = values[::step, ::step].astype(np.float64).ravel()
        black, white = percentiles(few, _FEW_PERCENT, 100 - _FEW_PERCENT).tolist()
        black, white = (black, white) if black < white else (low, high)
    enough = inside and not 0 < white - black < _LEAST_USED * span
    if not enough and not (may_stretch and 0 < white - black < math.inf):
        raise ImageError(f"pixel values run from {low:g} to {high:g}, outside 0 to {span:g}")
    if enough:
        black, white = 0.0, span
    scaled = np.empty(values.shape, np.uint8)
    band = max(1, _BAND_SAMPLES // max(1, math.prod(values.shape[1:])))
    for first in range(0, len(values), band):
        rows = slice(first, first + band)
        with np.errstate(over="ignore"):  # of a value far beyond all others
            share = (values[rows].astype(np.float64) - black) / (white - black)
        scaled[rows] = np.rint(255.0 * np.clip(share, 0, 1))
    run = f"its samples run from {low:g} to {high:g}"
    if is_byte and values.dtype.char == "H":
        return scaled, (f"{run}: 8 of their 16 bits are read",)
    note = f"{run}: {black:g} to {white:g} is scaled to black to white"
    return scaled, () if enough else (note,)


@dataclass(frozen=True, slots=True)
class RawSize:
    """The positive size of an image whose file is its pixels, row by row, 8, 4, 2 or 1 bits each.

    Of several pixels in a byte the first is in its high bits.
    """

    width: int
    height: int

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ImageError(f"a size must be positive, not {self}")

    @property
    def bytes(self) -> int:
        """Number of bytes of the file, with 8 bits a pixel."""
        return self.width * self.height

    def bits(self, size: int) -> int:
        """Return the bits of a pixel in a file of `size` bytes; 0 where none of these fit."""
        return next((bits for bits in _BITS if self.bytes * bits == size * 8), 0)

    @classmethod
    def parse(cls, text: str) -> RawSize:
        """Return what ``WIDTHxHEIGHT`` means, or raise ImageError."""
        size = _SIZE.fullmatch(text.strip())
        if size is None:
            raise ImageError(f"a size is written WIDTHxHEIGHT, as in 388x374, not {text!r}")
        return cls(int(size[1]), int(size[2]))

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


def decode_raw(data: bytes, size: RawSize, limits: ImageLimits) -> GreyImage:
    """Return `data` as the pixels of an image of `size`; raise ImageError if they do not fit."""
    limits.check(size.width, size.height)
    bits = size.bits(len(data))
    if not bits:
        raise ImageError(f"{len(data)} bytes are no {size} pixels of 8, 4, 2 or 1 bits")
    shifts = np.arange(8 - bits, -1, -bits, dtype=np.uint8)
    largest = 2**bits - 1
    values = (np.frombuffer(data, np.uint8)[:, None] >> shifts & largest) * np.uint8(255 // largest)
    notes = () if bits == _BITS[0] else (f"its {len(data)} bytes were read as {bits} bits a pixel",)
    return GreyImage(values.reshape(size.height, size.width), format="raw", notes=notes)

"""Cues by which ridges differ from valleys: pores, gaps, roughness and width of the two.

Skin that touches a sensor has pores, and is crossed by creases: dots and short gaps of the valleys'
grey level in the ridges. Valleys have few dots of the ridges' level. Ridges vary in width and grey
level with pressure and moisture, valleys in another way. Each cue compares the dark lines of a
print with its bright lines, so that it changes its sign, and nothing else, in the negative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.foreground import foreground_box
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.preprocess.percentiles import percentiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.normalize import NormalizedImage

    Field = NDArray[np.float32]
    Mask = NDArray[np.bool_]

LINE_CUES: Final = (
    "gaps along lines",
    "gaps along crests",
    "roughness along crests",
    "spread of crests",
    "spread of widths",
    "share of dark",
    "dots",
)
"""Names of the cues, in their order."""


@dataclass(frozen=True, slots=True)
class LineCueParameters:
    """Set how lines are found and compared; lengths in pixels at 500 dpi.

    Parameters
    ----------
    fine_sigma_px, dot_sigma_px : float
        Smoothing before curvatures, and before dots are looked for.
    line_sigma_px, ground_sigma_px : float
        Smoothing by which lines are found, and by which their surroundings are subtracted.
    flow_sigma_px : float
        Window of the orientation and of the strength of lines.
    line, crest : float
        Least height of a line and of its crest, in units of the local strength.
    min_coherence : float
        Coherence of the orientation below which there is no print.
    min_contrast : float
        Share of the image's strong contrast below which there is no print.
    margin_px : int
        By how much the print's border is left out.
    max_side_px : int
        Side of the part in the middle of the foreground that is looked at.
    min_px : int
        Pixels of print, and a tenth of them of either crest, below which there are no cues.
    prior_dots : float
        Dots that are added to the counts of either kind.
    """

    fine_sigma_px: float = 1.2
    dot_sigma_px: float = 0.7
    line_sigma_px: float = 2.0
    ground_sigma_px: float = 6.0
    flow_sigma_px: float = 8.0
    line: float = 0.3
    crest: float = 0.9
    min_coherence: float = 0.5
    min_contrast: float = 0.35
    margin_px: int = 4
    max_side_px: int = 448
    min_px: int = 800
    prior_dots: float = 3.0


_SHRUNK: Final = 4  # side of a pixel of the smaller images of which wide means are taken
_STRONG_PERCENTILE: Final = 90.0


def line_cues(
    grey: NDArray[np.uint8], parameters: LineCueParameters | None = None
) -> NDArray[np.float64] | None:
    """Compare the dark lines of a print with its bright lines.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Image at 500 dpi.
    parameters : LineCueParameters, optional
        Scales and limits.

    Returns
    -------
    ndarray of float64, shape (7,), or None
        The cues in the order of `LINE_CUES`; None where the image shows too few lines. Those of
        the negative are the same with the other sign.

    Examples
    --------
    >>> y, x = np.mgrid[:160, :160]
    >>> ridges = 128 + 100 * np.cos(x * 0.7)
    >>> pores = (y % 9 == 0) & (x % 9 == 4)
    >>> image = np.where(pores, 250, ridges).astype(np.uint8)
    >>> cues, negative = line_cues(image), line_cues(255 - image)
    >>> bool(np.allclose(cues, -negative, atol=1e-3))
    True
    """
    p = parameters or LineCueParameters()
    image = normalize(_middle(grey, p.max_side_px))
    ridges = _blurred(image.pixels, p.line_sigma_px)
    ridges -= _enlarged(_wide_mean(image.pixels, p.ground_sigma_px), ridges)
    across, print_ = _flow(ridges, image, p)
    strength = np.sqrt(_wide_mean(ridges * ridges, p.ground_sigma_px))
    height = ridges / np.maximum(_enlarged(strength, ridges), 1e-3)
    dark, bright = print_ & (height > p.line), print_ & (height < -p.line)
    crest, bed = print_ & (height > p.crest), print_ & (height < -p.crest)
    enough = min(np.count_nonzero(crest), np.count_nonzero(bed)) >= p.min_px / 10
    if not enough or np.count_nonzero(print_) < p.min_px:
        return None
    fine = _blurred(image.pixels, p.fine_sigma_px)
    along, beside = _curvatures(fine, across)
    return np.array(
        [
            _skewness(along[print_]),
            _skewness(along[dark]) + _skewness(along[bright]),
            _log_ratio(along[crest].std(), along[bed].std()),
            _log_ratio(fine[crest].std(), fine[bed].std()),
            _log_ratio(beside[bed].std(), beside[crest].std()),
            2 * np.count_nonzero(image.pixels[print_] > 0) / np.count_nonzero(print_) - 1,
            _dots(image.pixels, dark, bright, p),
        ]
    )


def _middle(grey: NDArray[np.uint8], side: int) -> NDArray[np.uint8]:
    """Return the foreground of an image, or the middle of a large one."""
    found = grey[foreground_box(grey).slices]
    top, left = (max(0, (length - side) // 2) for length in found.shape)
    return np.ascontiguousarray(found[top : top + side, left : left + side])


def _flow(
    ridges: Field, image: NormalizedImage, p: LineCueParameters
) -> tuple[tuple[Field, Field], Mask]:
    """Return the direction across the lines, and where there are lines, without the border.

    The direction is the unit vector of twice its angle.
    """
    half = _shrunk(ridges, 2)
    gx, gy = (cv2.Sobel(half, cv2.CV_32F, *order) for order in ((1, 0), (0, 1)))
    sigma = p.flow_sigma_px / _SHRUNK
    xx, xy, yy = (_blurred(_shrunk(g, _SHRUNK // 2), sigma) for g in (gx * gx, gx * gy, gy * gy))
    difference, doubled = xx - yy, 2 * xy
    size = np.sqrt(difference * difference + doubled * doubled) + np.float32(1e-9)
    coherent = (size > p.min_coherence * (xx + yy)).view(np.uint8)
    strong = float(percentiles(_shrunk(image.contrast, _SHRUNK).ravel(), _STRONG_PERCENTILE)[0])
    found = image.valid & (image.contrast > p.min_contrast * strong)
    found &= cv2.resize(coherent, ridges.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
    found[[0, -1]] = found[:, [0, -1]] = False
    element = np.ones((2 * p.margin_px + 1,) * 2, np.uint8)
    print_ = np.asarray(cv2.erode(found.view(np.uint8), element), bool)
    return (_enlarged(difference / size, ridges), _enlarged(doubled / size, ridges)), print_


def _curvatures(image: Field, across: tuple[Field, Field]) -> tuple[Field, Field]:
    """Return the second derivatives along the lines and across them."""
    cosine, sine = across
    xx, xy, yy = (cv2.Sobel(image, cv2.CV_32F, *order) for order in ((2, 0), (1, 1), (0, 2)))
    both = xx + yy
    along = 0.5 * (both - cosine * (xx - yy)) - sine * xy
    return along, both - along


def _dots(pixels: Field, dark: Mask, bright: Mask, p: LineCueParameters) -> float:
    """Return the logarithm of the bright dots in dark lines to the dark dots in bright lines."""
    smooth, element = _blurred(pixels, p.dot_sigma_px), np.ones((3, 3), np.uint8)
    pits = dark & (smooth <= cv2.erode(smooth, element))
    peaks = bright & (smooth >= cv2.dilate(smooth, element))
    return math.log((pits.sum() + p.prior_dots) / (peaks.sum() + p.prior_dots))


def _blurred(image: Field, sigma: float) -> Field:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)


def _shrunk(image: Field, factor: int) -> Field:
    size = tuple(max(1, side // factor) for side in image.shape[::-1])
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.float32)


def _wide_mean(image: Field, sigma: float) -> Field:
    """Return a mean over a window much wider than a few pixels, of every fourth pixel."""
    return _blurred(_shrunk(image, _SHRUNK), sigma / _SHRUNK)


def _enlarged(image: Field, like: Field) -> Field:
    return np.asarray(cv2.resize(image, like.shape[::-1]), np.float32)


def _skewness(values: Field) -> float:
    values = values - values.mean()
    square = values * values
    return float((square * values).mean() / max(float(square.mean()), 1e-9) ** 1.5)


def _log_ratio(first: float, second: float) -> float:
    return math.log((float(first) + 1e-4) / (float(second) + 1e-4))

"""Cues by which ridges differ from valleys: pores, gaps, roughness and width.

Pores and creases are dots and short gaps of the valleys' grey level in the ridges; valleys have few
dots of the ridges' level. Width and grey level vary with pressure and moisture, differently for
ridges and for valleys. Each cue compares the dark lines of a print with its bright lines, so that
the negative image has the opposite value. The weights of the cues were learned from synthetic
prints by ``python -m research train polarity``.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.arrays import percentiles
from fpmatch.image.preprocess.foreground import foreground_box, stretch_contrast
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.quality.measures import LinearWeights
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Doubles, Floats, Grey, Mask
    from fpmatch.image.preprocess.normalize import NormalizedImage

LINE_CUES: Final = (
    "gaps along lines", "gaps along crests", "roughness along crests", "spread of crests",
    "spread of widths", "share of dark", "dots",
)  # fmt: skip

# Lengths in pixels at 500 dpi.
_FINE_SIGMA, _DOT_SIGMA = 1.2, 0.7  # smoothing before curvatures, and before the search for dots
_LINE_SIGMA, _GROUND_SIGMA = 2.0, 6.0  # smoothing of lines, and of the ground subtracted from them
_FLOW_SIGMA: Final = 8.0  # window of the orientation
_LINE, _CREST = 0.3, 0.9  # least height of a line and of its crest, in units of the local strength
_MIN_COHERENCE: Final = 0.5
_MIN_CONTRAST: Final = 0.35  # share of the image's strong contrast, at the percentile below
_STRONG_PERCENTILE: Final = 90.0
_MARGIN: Final = 4  # eroded from the print's border
MAX_SIDE: Final = 448  # side of the middle part of the foreground that is measured
_MIN_AREA: Final = 800  # pixels of the print; of either crest a tenth
_PRIOR_DOTS: Final = 3.0  # added to the counts of either kind
_SHRUNK: Final = 4  # side of a pixel of the smaller images that wide means are taken of
WEIGHTS_FILE: Final = Path(__file__).with_name("polarity.json")
MAX_EVIDENCE: Final = 8.0  # log-odds, of one image
FARTHEST_CUE: Final = 4.0  # in units of its usual size, beyond which a cue counts no more
MAX_PX: Final = 16_000_000  # at 500 dpi; a larger image is no print and gives no evidence


def line_cues(grey: Grey) -> Doubles | None:
    """Return the cues of an image (H, W) at 500 dpi, shape (7,); None if it shows too few lines."""
    image = normalize(_middle(grey, MAX_SIDE))
    ridges = _blurred(image.pixels, _LINE_SIGMA)
    ridges -= _enlarged(_wide_mean(image.pixels, _GROUND_SIGMA), ridges)
    across, print_ = _flow(ridges, image)
    strength = np.sqrt(_wide_mean(ridges * ridges, _GROUND_SIGMA))
    height = ridges / np.maximum(_enlarged(strength, ridges), 1e-3)
    dark, bright = print_ & (height > _LINE), print_ & (height < -_LINE)
    crest, bed = print_ & (height > _CREST), print_ & (height < -_CREST)
    enough = min(np.count_nonzero(crest), np.count_nonzero(bed)) >= _MIN_AREA / 10
    if not enough or np.count_nonzero(print_) < _MIN_AREA:
        return None
    fine = _blurred(image.pixels, _FINE_SIGMA)
    along, beside = _curvatures(fine, across)
    cues = (
        _skewness(along[print_]),
        _skewness(along[dark]) + _skewness(along[bright]),
        _log_ratio(along[crest].std(), along[bed].std()),
        _log_ratio(fine[crest].std(), fine[bed].std()),
        _log_ratio(beside[bed].std(), beside[crest].std()),
        2 * np.count_nonzero(image.pixels[print_] > 0) / np.count_nonzero(print_) - 1,
        _dots(image.pixels, dark, bright),
    )
    return np.array(cues)


def _middle(grey: Grey, side: int) -> Grey:
    """Return the foreground of an image, or the middle of a large one."""
    grey = stretch_contrast(grey)
    foreground = grey[foreground_box(grey).slices]
    top, left = (max(0, (length - side) // 2) for length in foreground.shape)
    return np.ascontiguousarray(foreground[top : top + side, left : left + side])


def _flow(ridges: Floats, image: NormalizedImage) -> tuple[tuple[Floats, Floats], Mask]:
    """Return the direction across the lines, its angle doubled, and where there are lines."""
    half = _shrunk(ridges, 2)
    gx, gy = (cv2.Sobel(half, cv2.CV_32F, *order) for order in ((1, 0), (0, 1)))
    sigma = _FLOW_SIGMA / _SHRUNK
    xx, xy, yy = (_blurred(_shrunk(g, _SHRUNK // 2), sigma) for g in (gx * gx, gx * gy, gy * gy))
    difference, doubled = xx - yy, 2 * xy
    size = np.sqrt(difference * difference + doubled * doubled) + np.float32(1e-9)
    coherent = (size > _MIN_COHERENCE * (xx + yy)).view(np.uint8)
    strong = float(percentiles(_shrunk(image.contrast, _SHRUNK).ravel(), _STRONG_PERCENTILE)[0])
    lines = image.valid & (image.contrast > _MIN_CONTRAST * strong)
    lines &= cv2.resize(coherent, ridges.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
    lines[[0, -1]] = lines[:, [0, -1]] = False
    element = np.ones((2 * _MARGIN + 1,) * 2, np.uint8)
    print_ = np.asarray(cv2.erode(lines.view(np.uint8), element), bool)
    return (_enlarged(difference / size, ridges), _enlarged(doubled / size, ridges)), print_


def _curvatures(image: Floats, across: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return the second derivatives along the lines and across them."""
    cosine, sine = across
    xx, xy, yy = (cv2.Sobel(image, cv2.CV_32F, *order) for order in ((2, 0), (1, 1), (0, 2)))
    both = xx + yy
    along = 0.5 * (both - cosine * (xx - yy)) - sine * xy
    return along, both - along


def _dots(pixels: Floats, dark: Mask, bright: Mask) -> float:
    """Return the log ratio of the bright dots in dark lines to the dark dots in bright lines."""
    smooth, element = _blurred(pixels, _DOT_SIGMA), np.ones((3, 3), np.uint8)
    pits = dark & (smooth <= cv2.erode(smooth, element))
    peaks = bright & (smooth >= cv2.dilate(smooth, element))
    return math.log((pits.sum() + _PRIOR_DOTS) / (peaks.sum() + _PRIOR_DOTS))


def _blurred(image: Floats, sigma: float) -> Floats:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)


def _shrunk(image: Floats, factor: int) -> Floats:
    size = tuple(max(1, side // factor) for side in image.shape[::-1])
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.float32)


def _wide_mean(image: Floats, sigma: float) -> Floats:
    """Return a mean over a window much wider than a few pixels, of every fourth pixel."""
    return _blurred(_shrunk(image, _SHRUNK), sigma / _SHRUNK)


def _enlarged(image: Floats, like: Floats) -> Floats:
    return np.asarray(cv2.resize(image, like.shape[::-1]), np.float32)


def _skewness(values: Floats) -> float:
    values = values - values.mean()
    square = values * values
    return float((square * values).mean() / max(float(square.mean()), 1e-9) ** 1.5)


def _log_ratio(first: float, second: float) -> float:
    return math.log((float(first) + 1e-4) / (float(second) + 1e-4))


def polarity_evidence(grey: Grey, dpi: float = STANDARD_DPI) -> float:
    """Return the log-odds that the ridges of an image (H, W) are dark, by its lines; else 0."""
    at_500_dpi = _resampled(grey, dpi)
    cues = None if at_500_dpi is None else line_cues(at_500_dpi)
    if cues is None:
        return 0.0
    return float(evidence_of_cues(cues, LinearWeights.load(WEIGHTS_FILE, LINE_CUES)))


def evidence_of_cues(cues: Doubles, weights: LinearWeights) -> Doubles:
    """Return the log-odds that ridges are dark, of cues of shape (..., 7)."""
    limited = np.clip(weights.standardized(cues), -FARTHEST_CUE, FARTHEST_CUE)
    return np.asarray(np.clip(limited @ weights.weight, -MAX_EVIDENCE, MAX_EVIDENCE))


def _resampled(grey: Grey, dpi: float) -> Grey | None:
    """Return an image at about 500 dpi; None where it is too large for a print."""
    zoom = STANDARD_DPI / dpi
    width, height = (max(1, round(side * zoom)) for side in grey.shape[::-1])
    if width * height > MAX_PX:
        return None
    if abs(zoom - 1) < 0.01:
        return grey
    interpolation = cv2.INTER_AREA if zoom < 1 else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(grey, (width, height), interpolation=interpolation), np.uint8)

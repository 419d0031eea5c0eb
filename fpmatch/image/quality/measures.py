"""Physical quality measures of a whole print, on the stages of its extraction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.arrays import percentiles
from fpmatch.image.preprocess.foreground import ridge_contrast, stretch_contrast
from fpmatch.image.quality.ridge_scale import clear_period_px
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Doubles, Floats, Mask

MM_PER_PX: Final = 25.4 / STANDARD_DPI

# Lengths in pixels at 500 dpi, contrasts in grey levels.
_GRAIN_SIGMA: Final = 0.8  # smoothing of single pixels before ridges are separated from valleys
_LEVELS_SIDE: Final = 11  # window of the ridge and valley levels: at least a ridge period
_CERTAIN: Final = 0.75  # share of the root mean square at which an enhanced pixel is certain
_BACKGROUND_SIGMA: Final = 8.0  # of the background that is subtracted before the spectrum
_EDGE_SIGMA: Final = 4.0  # of the border of the measured area
_FINE_PERIODS: Final = (2.2, 5.0)  # finer than ridges; compared with the coarse ones
_COARSE_PERIODS: Final = (6.0, 15.0)
_NOISE_PERIODS: Final = (2.0, 2.17)  # of noise alone
_RINGS_PER_CYCLE: Final = 200  # of frequency: rings of 0.005 cycles a pixel
_RINGS: Final = _RINGS_PER_CYCLE // 2


@dataclass(frozen=True, slots=True)
class QualityMeasures:
    """The quality measures of one print; NaN where there is nothing to measure.

    Spreads are standard deviations of the normalised grey values: 0 where they are even, 1 where
    they are as rough as the whole.
    """

    image_mm2: float  # area of the image
    ridges_mm2: float  # area of its ridges
    minutiae: float  # number of minutiae, weighted by their quality
    dark_share: float  # of that area, darker than the mean of ridge and valley; half where even
    ridge_spread: float
    valley_spread: float
    period_px: float  # median ridge period in pixels at 500 dpi, where it is clear
    detail: float  # energy finer than ridges over that of ridges; near 0 in a blurred image
    contrast: float = math.inf  # of ridges and valleys, in grey levels


def measure_quality(stages: Mapping[str, NDArray[np.generic]]) -> QualityMeasures:
    """Measure a print on the stages of its extraction that a `StageRecorder` keeps."""
    shown = np.asarray(stages["input"], np.uint8)
    mask = stages["mask"].astype(bool)
    stretched = stretch_contrast(shown) if mask.any() else shown
    grey = stretched.astype(np.float32)
    quality = stages["minutiae"][:, 4].astype(np.float64)
    return QualityMeasures(
        grey.size * MM_PER_PX**2,
        float(np.count_nonzero(mask)) * MM_PER_PX**2,
        float(quality.sum()) / 100.0,
        _dark_share(grey, mask),
        *_spreads(stages["normalised"][mask].astype(np.float64), stages["enhanced"][mask]),
        clear_period_px(stretched) or math.nan,
        _detail(grey, mask),
        ridge_contrast(shown),
    )


def _dark_share(grey: Floats, mask: Mask) -> float:
    if not mask.any():
        return math.nan
    box = np.ones((_LEVELS_SIDE, _LEVELS_SIDE), np.uint8)
    smooth = cv2.GaussianBlur(grey, (0, 0), _GRAIN_SIGMA)
    extremes = cv2.add(cv2.dilate(smooth, box), cv2.erode(smooth, box))
    middle = cv2.blur(extremes, (_LEVELS_SIDE, _LEVELS_SIDE)) / 2
    return float(np.mean(smooth[mask] < middle[mask]))


def _spreads(pixels: Doubles, enhanced: NDArray[np.generic]) -> tuple[float, float]:
    """Return the standard deviations of the pixels that are certainly ridge, or valley."""
    signal = enhanced.astype(np.float64)
    certain = _CERTAIN * math.sqrt(float(np.mean(signal**2))) if signal.size else 0.0
    sides = pixels[signal > certain], pixels[signal < -certain]
    ridges, valleys = (float(side.std()) if side.size else math.nan for side in sides)
    return ridges, valleys


def _detail(grey: Floats, mask: Mask) -> float:
    """Return the energy finer than ridges over that of ridges, in the spectrum of a print."""
    weight = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), _EDGE_SIGMA)
    window = (grey - cv2.GaussianBlur(grey, (0, 0), _BACKGROUND_SIGMA)) * weight
    margin = round(4 * _EDGE_SIGMA)
    shape = tuple(cv2.getOptimalDFTSize(side + margin) for side in window.shape)
    wave = np.fft.rfft2(window, shape)
    power = wave.real**2 + wave.imag**2
    power[:, 1:] *= 2.0  # the other half of the plane
    ring, size = _rings(shape[0], shape[1])
    energy = np.bincount(ring, power.ravel(), _RINGS + 1)[:_RINGS]
    frequency = (np.arange(_RINGS) + 0.5) / _RINGS_PER_CYCLE
    noise, fine, coarse = (
        (frequency >= 1 / longest) & (frequency < 1 / shortest)
        for shortest, longest in (_NOISE_PERIODS, _FINE_PERIODS, _COARSE_PERIODS)
    )
    signal = np.maximum(energy - percentiles((energy / size)[noise], 50) * size, 0.0)
    return float(signal[fine].sum() / signal[coarse].sum()) if signal[coarse].any() else math.nan


@lru_cache(maxsize=8)
def _rings(rows: int, columns: int) -> tuple[NDArray[np.intp], Doubles]:
    """Return the ring of each wave of `numpy.fft.rfft2`, flat, and how many waves each has."""
    y, x = np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(columns)
    ring = np.minimum(_RINGS_PER_CYCLE * np.hypot(y, x), _RINGS).astype(np.intp)
    weight = np.full(ring.shape, 2.0)
    weight[:, 0] = 1.0
    size = np.bincount(ring.ravel(), weight.ravel(), _RINGS + 1)[:_RINGS]
    return ring.ravel(), np.maximum(size, 1.0)

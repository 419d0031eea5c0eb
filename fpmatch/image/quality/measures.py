"""What the stages of an extraction say of the print as a whole, in a few physical figures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.percentiles import percentiles
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

MM_PER_PX: Final = 25.4 / STANDARD_DPI
MEASURED_STAGES: Final = ("input", "normalised", "enhanced", "mask", "minutiae")
"""The stages, as a recorder gets them, that figures are measured on."""
_RINGS_PER_CYCLE: Final = 200  # of frequency: rings of 0.005 cycles a pixel
_RINGS: Final = _RINGS_PER_CYCLE // 2
_NO_SPECTRUM: Final = (math.nan, math.nan, math.nan, math.nan, 0.0)


@dataclass(frozen=True, slots=True)
class QualityMeasureParameters:
    """Set how the figures are measured; lengths in pixels at 500 dpi, contrasts in grey levels.

    Parameters
    ----------
    grain_sigma_px : float
        Blur that takes the grain of single pixels off before ridges are told from valleys.
    levels_px : int
        Side of the square whose extremes are the levels of ridge and valley: a period or more.
    certain : float
        Share of its root mean square from which an enhanced pixel is surely ridge or valley.
    background_sigma_px, edge_sigma_px : float
        Blur that is taken off before the spectrum, and that softens the border of what is looked
        at.
    min_ridges_mm2 : float
        Area of ridges below which the spectrum is that of all that has contrast.
    min_contrast, relative_contrast : float
        What has contrast: in grey levels, and as a share of the strongest.
    ridge_periods_px, fine_periods_px, coarse_periods_px : tuple of float
        From the shortest to the longest: what may be ridges, what is finer than ridges, and what
        the finer is held against.
    noise_periods_px : tuple of float
        Where there is noise alone.
    about_peak : float
        Factor about the strongest period within which the energy is that of the ridges.
    any_periods_px : tuple of float
        From the shortest to the longest that is looked for where the resolution may be wrong.
    """

    grain_sigma_px: float = 0.8
    levels_px: int = 11
    certain: float = 0.75
    background_sigma_px: float = 8.0
    edge_sigma_px: float = 4.0
    min_ridges_mm2: float = 20.0
    min_contrast: float = 6.0
    relative_contrast: float = 0.4
    ridge_periods_px: tuple[float, float] = (4.2, 22.0)
    fine_periods_px: tuple[float, float] = (2.2, 5.0)
    coarse_periods_px: tuple[float, float] = (6.0, 15.0)
    noise_periods_px: tuple[float, float] = (2.0, 2.17)
    about_peak: float = 1.33
    any_periods_px: tuple[float, float] = (2.6, 28.0)


@dataclass(frozen=True, slots=True)
class QualityMeasures:
    """Hold the figures of one print; not a number where there is nothing to measure.

    Parameters
    ----------
    image_mm2, ridges_mm2 : float
        Area of the image, and of where ridges are found in it.
    minutiae : float
        Number of minutiae, each counted by its quality.
    dark_share : float
        Share of the ridges' area that is darker than the middle between ridge and valley: less
        than half where ridges are thin and pale, more where they run together.
    ridge_spread, valley_spread : float
        Standard deviation of the normalised grey values on ridges and in valleys: of 0 where they
        are even, of 1 where they are as rough as the whole.
    period_px : float
        Mean distance from ridge to ridge, in pixels at 500 dpi.
    concentration : float
        Share of the image's energy that lies about one period: whether that is one of ridges.
    detail : float
        Energy of what is finer than ridges over that of the ridges: hardly any where the image is
        blurred.
    peak_px, peak_share : float
        The strongest period among far more than ridges of people have, in pixels at 500 dpi, and
        the share of all energy, noise and all, that lies about it: the distance from ridge to
        ridge also where the resolution is not the one that is told.
    """

    image_mm2: float
    ridges_mm2: float
    minutiae: float
    dark_share: float
    ridge_spread: float
    valley_spread: float
    period_px: float
    concentration: float
    detail: float
    peak_px: float = math.nan
    peak_share: float = 0.0


def measure_quality(
    stages: Mapping[str, NDArray[np.generic]], parameters: QualityMeasureParameters | None = None
) -> QualityMeasures:
    """Measure a print on the stages of its extraction.

    Parameters
    ----------
    stages : mapping of str to ndarray
        Those of `MEASURED_STAGES`, as a recorder receives them.
    parameters : QualityMeasureParameters, optional
        How it is measured.

    Returns
    -------
    QualityMeasures
        Its figures.

    Examples
    --------
    >>> from fpmatch.image.extract import extract
    >>> from fpmatch.image.recorder import StageRecorder
    >>> stages = StageRecorder()
    >>> waves = np.tile(128 + 90 * np.sin(np.arange(200) * 2 * np.pi / 9), (200, 1))
    >>> _ = extract(waves.astype(np.uint8), dpi=500, recorder=stages)
    >>> figures = measure_quality(stages.stages)
    >>> round(figures.period_px), round(figures.image_mm2)
    (9, 103)
    """
    p = parameters or QualityMeasureParameters()
    grey = stages["input"].astype(np.float32)
    mask = stages["mask"].astype(bool)
    quality = stages["minutiae"][:, 4].astype(np.float64)
    area = float(np.count_nonzero(mask)) * MM_PER_PX**2
    looked_at = mask if area >= p.min_ridges_mm2 else _of_contrast(grey, p)
    ridges, valleys = _spreads(
        stages["normalised"][mask].astype(np.float64), stages["enhanced"][mask], p
    )
    return QualityMeasures(
        grey.size * MM_PER_PX**2,
        area,
        float(quality.sum()) / 100.0,
        _dark_share(grey, mask, p),
        ridges,
        valleys,
        *_spectral_figures(grey, looked_at, p),
    )


def _dark_share(
    grey: NDArray[np.float32], mask: NDArray[np.bool_], p: QualityMeasureParameters
) -> float:
    if not mask.any():
        return math.nan
    box = np.ones((p.levels_px, p.levels_px), np.uint8)
    smooth = cv2.GaussianBlur(grey, (0, 0), p.grain_sigma_px)
    extremes = cv2.add(cv2.dilate(smooth, box), cv2.erode(smooth, box))
    middle = cv2.blur(extremes, (p.levels_px, p.levels_px)) / 2
    return float(np.mean(smooth[mask] < middle[mask]))


def _spreads(
    pixels: NDArray[np.float64], enhanced: NDArray[np.generic], p: QualityMeasureParameters
) -> tuple[float, float]:
    """Return the standard deviations of pixels that are surely ridge, and surely valley."""
    signal = enhanced.astype(np.float64)
    certain = p.certain * math.sqrt(float(np.mean(signal**2))) if signal.size else 0.0
    sides = pixels[signal > certain], pixels[signal < -certain]
    ridges, valleys = (float(side.std()) if side.size else math.nan for side in sides)
    return ridges, valleys


def _of_contrast(grey: NDArray[np.float32], p: QualityMeasureParameters) -> NDArray[np.bool_]:
    """Return where the image has contrast, ridges or not."""
    detail = grey - cv2.GaussianBlur(grey, (0, 0), p.background_sigma_px)
    contrast = np.sqrt(cv2.GaussianBlur(detail * detail, (0, 0), p.background_sigma_px))
    strong = p.relative_contrast * float(percentiles(contrast.ravel(), 95)[0])
    return np.asarray(contrast > max(p.min_contrast, strong))


def _spectral_figures(
    grey: NDArray[np.float32], looked_at: NDArray[np.bool_], p: QualityMeasureParameters
) -> tuple[float, float, float, float, float]:
    """Return period, concentration, detail, and the peak with its share, of a print's spectrum."""
    if np.count_nonzero(looked_at) * MM_PER_PX**2 < p.min_ridges_mm2 / 2:
        return _NO_SPECTRUM
    weight = cv2.GaussianBlur(looked_at.astype(np.float32), (0, 0), p.edge_sigma_px)
    window = (grey - cv2.GaussianBlur(grey, (0, 0), p.background_sigma_px)) * weight
    margin = round(4 * p.edge_sigma_px)
    shape = tuple(cv2.getOptimalDFTSize(side + margin) for side in window.shape)
    wave = np.fft.rfft2(window, shape)
    power = wave.real**2 + wave.imag**2
    power[:, 1:] *= 2.0  # the other half of the plane
    ring, size = _rings(shape[0], shape[1])
    energy = np.bincount(ring, power.ravel(), _RINGS + 1)[:_RINGS]
    frequency = (np.arange(_RINGS) + 0.5) / _RINGS_PER_CYCLE

    def within(periods: tuple[float, float]) -> NDArray[np.bool_]:
        return np.asarray((frequency >= 1 / periods[1]) & (frequency < 1 / periods[0]))

    noise = float(percentiles((energy / size)[within(p.noise_periods_px)], 50)[0])
    signal = np.maximum(energy - noise * size, 0.0)
    ridges = within(p.ridge_periods_px)
    total, ridge_energy = float(signal.sum()), float(signal[ridges].sum())
    coarse = float(signal[within(p.coarse_periods_px)].sum())
    if not min(ridge_energy, coarse) > 0:
        return _NO_SPECTRUM
    mean = float((frequency * signal)[ridges].sum()) / ridge_energy
    smooth = np.convolve(signal, np.ones(3), "same")

    def about_peak(looked_for: NDArray[np.bool_]) -> NDArray[np.bool_]:
        peak = float(frequency[looked_for][smooth[looked_for].argmax()])
        return within((1 / (peak * p.about_peak), p.about_peak / peak))

    fine = float(signal[within(p.fine_periods_px)].sum())
    concentration = float(signal[about_peak(ridges)].sum()) / total
    peak = about_peak(within(p.any_periods_px))
    peak_energy = float(signal[peak].sum())
    peak_px = peak_energy / float((frequency * signal)[peak].sum())
    # Of all the energy: what is left of mere noise without its floor may have a peak too.
    return 1 / mean, concentration, fine / coarse, peak_px, peak_energy / float(energy.sum())


@lru_cache(maxsize=8)
def _rings(rows: int, columns: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the ring of each wave of `numpy.fft.rfft2`, flat, and how many waves each has."""
    y, x = np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(columns)
    ring = np.minimum(_RINGS_PER_CYCLE * np.hypot(y, x), _RINGS).astype(np.intp)
    weight = np.full(ring.shape, 2.0)
    weight[:, 0] = 1.0
    size = np.bincount(ring.ravel(), weight.ravel(), _RINGS + 1)[:_RINGS]
    return ring.ravel(), np.maximum(size, 1.0)

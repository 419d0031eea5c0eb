"""Ridge scale: the resolution that the distance of the ridges of an image indicates.

Programs that edit or photograph write resolutions of their own into a file (72, 96, 180, 200, 300),
or none. The ridges of a finger lie 0.3 to 0.6 mm apart, in the median of a print. The period is
measured in pixels, in windows where one wave has much of the energy. A resolution cannot be right
if it puts the period far outside that range, while 500 dpi puts it inside; where files state
none, it is 500 dpi unless that puts the median period of the prints outside what fingers have.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.arrays import percentiles
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, MM_PER_INCH, STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.image.preprocess.arrays import Floats, Grey

PERIODS_MM: Final = (0.26, 0.7)
"""Least and largest median period of a print that is believed: a child's, a large hand's."""

PERIODS_PX: Final = (6.0, 12.3)
"""Range of the median ridge periods of people, in pixels at 500 dpi."""

UNQUESTIONED_DPI: Final = (450.0, 600.0)
"""Resolutions of live scanners and scanned cards, which are not questioned."""

USUAL_DPI: Final = (STANDARD_DPI, 250.0, 363.0, 569.0, 1000.0)
"""Resolutions of an image that states none; 508 and 512 dpi do not differ from 500."""

TYPICAL_MM: Final = 0.45
"""Typical median period of the prints of a sensor; `research check resolution` measures it."""

SENSORS_MM: Final = (0.34, 0.62)
"""Least and largest median period of many prints of a sensor."""

SENSORS_SD: Final = 0.1
"""Deviation of the logarithm of that median from sensor to sensor."""

PRINTS_SD: Final = 0.13
"""Deviation of the logarithm of the period from print to print, of the least regular sensor."""

_DEVIATIONS: Final = 2.9  # of the mean of a few prints, beside the limits of the sensor's median

POSSIBLE_MM: Final = (0.31, 0.63)  # of a print that is tried at another resolution
MAX_PX: Final = 4_000_000  # to which it is enlarged; four flat fingers have 2.5 million
_STANDARD_MM: Final = (0.3, 0.65)  # a clear period of a print at 500 dpi
_WINDOW_PX: Final = 64
_SPECTRUM_PX: Final = 64
_MEASURED_PX: Final = (2.6, 30.0)
_LONG_PX: Final = 20.0  # period of too few ridges in a window
_MAX_WINDOWS: Final = 128
_MAX_CLEAR: Final = 32  # windows that are looked at
_LEAST_CONTRAST: Final = 0.35  # of that of the clearest windows
_PEAK_RADIUS: Final = 0.022  # cycles a pixel
_LEAST_SHARE: Final = 0.2  # of a window's energy in its strongest wave
_LEAST_WINDOWS: Final = 4
_MOST_SPREAD: Final = 1.4  # ratio of the 80th to the 20th percentile of the periods


# The spectrum's plane: radius in cycles a pixel, weights that flatten the spectrum of anything but
# ridges (0 outside the periods), taper of a window, and rows and columns of the disc about a peak.
_X: Final = np.fft.rfftfreq(_SPECTRUM_PX)[: int(_SPECTRUM_PX / _MEASURED_PX[0]) + 2]
_RADIUS: Final = np.hypot(np.fft.fftfreq(_SPECTRUM_PX)[:, None], _X).astype(np.float32)
_INSIDE: Final = (1.0 / _MEASURED_PX[1] < _RADIUS) & (1.0 / _MEASURED_PX[0] > _RADIUS)
_WEIGHT: Final = np.where(_INSIDE, _RADIUS**2, 0)
_TAPER: Final = np.outer(*2 * [np.hanning(_WINDOW_PX + 2)[1:-1].astype(np.float32)])
_REACH: Final = int(_PEAK_RADIUS * _SPECTRUM_PX)
_AROUND: Final = np.indices(2 * (2 * _REACH + 1,)).reshape(2, -1) - _REACH
_DISC: Final = _AROUND[:, np.hypot(*_AROUND) < _PEAK_RADIUS * _SPECTRUM_PX]


def contradiction(pixels: Grey, dpi: float) -> str:
    """Return what contradicts a resolution of grey values (H, W), "" where nothing clearly does."""
    if _within(dpi, UNQUESTIONED_DPI):
        return ""
    period = ridge_period_px(pixels)
    if period is None or not _within(period * MM_PER_INCH / STANDARD_DPI, _STANDARD_MM):
        return ""
    apart = period * MM_PER_INCH / dpi
    if _within(apart, PERIODS_MM):
        return ""
    return f"at its resolution of {dpi:g} dpi ridges would be {apart:.2g} mm apart: ignored"


def likely_dpi(pixels: Grey) -> float:
    """Return the most probable resolution of an image: 500 dpi unless the ridges rule it out."""
    return possible_dpi(clear_period_px(pixels), pixels.shape)[0]


def possible_dpi(period_px: float | None, shape: tuple[int, ...]) -> list[float]:
    """Return the usual resolutions that ridges allow, the most probable first; of None, all.

    Where they allow none of these, it is one of about the typical distance, else 500 dpi. An image
    of this shape (H, W) keeps a size at 500 dpi that a print may have.
    """
    usual = [dpi for dpi in USUAL_DPI if is_sound(shape, dpi)]
    if period_px is None:
        return usual
    apart = {dpi: period_px * MM_PER_INCH / dpi for dpi in usual}
    possible = [dpi for dpi in usual if _within(apart[dpi], POSSIBLE_MM)]
    possible.sort(key=lambda dpi: abs(math.log(apart[dpi] / TYPICAL_MM)))
    first = common_dpi([period_px])
    if first != STANDARD_DPI and possible:
        return possible
    return list(dict.fromkeys([first if is_sound(shape, first) else STANDARD_DPI, *possible]))


def common_dpi(periods_px: Sequence[float], usual: float = STANDARD_DPI) -> float:
    """Return the resolution of prints of one sensor by the distances of their ridges in pixels.

    It is the usual one unless this puts their median too far from the typical, the farther the
    fewer they are; else the one that makes it typical: half or a multiple of 500 dpi by a power of
    two where one is as near as sensors differ, else a multiple of 10 dpi.

    Examples
    --------
    >>> common_dpi([9.1, 8.4]), common_dpi([5.8]), common_dpi([5.8] * 30), common_dpi([17.5])
    (500.0, 500.0, 330.0, 1000.0)
    """
    if not periods_px:
        return usual
    period = float(np.median(periods_px)) * MM_PER_INCH  # in mm, times the resolution in dpi
    low, high = np.log(SENSORS_MM).tolist()
    most = math.hypot((high - low) / 2, _DEVIATIONS * PRINTS_SD / math.sqrt(len(periods_px)))
    for dpi in (usual, STANDARD_DPI):
        if abs(math.log(period / dpi) - (low + high) / 2) <= most:
            return dpi
    off = math.log(period / STANDARD_DPI / TYPICAL_MM)
    doubled = round(off / math.log(2.0))
    if abs(off - doubled * math.log(2.0)) <= SENSORS_SD and doubled:
        return STANDARD_DPI * 2.0**doubled
    return round(STANDARD_DPI * math.exp(off), -1)


def is_sound(shape: tuple[int, ...], dpi: float) -> bool:
    """Return whether an image of this shape is neither too large nor too small at a resolution."""
    if dpi == STANDARD_DPI:
        return True
    height, width = (side * STANDARD_DPI / max(dpi, 1.0) for side in shape)
    small = dpi > STANDARD_DPI or height * width <= MAX_PX
    return MIN_DPI <= dpi <= MAX_DPI and small and min(height, width) >= _WINDOW_PX / 2


def clear_period_px(pixels: Grey) -> float | None:
    """Return the median distance of ridges in pixels, however close; None where it is not clear."""
    period = ridge_period_px(pixels)
    if period is None and pixels.size <= MAX_PX / 4:  # a window may have too many ridges
        period = _period_at(pixels, 2.0, cv2.INTER_LINEAR)
    zoom = 0.5
    while period * zoom > _LONG_PX / 2 if period else zoom == 0.5:
        reduced = _period_at(pixels, zoom, cv2.INTER_AREA)
        if reduced is None:
            break
        period, zoom = reduced, zoom / 2
    return period


def _period_at(pixels: Grey, zoom: float, interpolation: int) -> float | None:
    """Return the median distance of ridges in pixels, as the image shows it at another size."""
    if min(pixels.shape) * zoom < _WINDOW_PX:
        return None
    zoomed = cv2.resize(pixels, None, fx=zoom, fy=zoom, interpolation=interpolation)
    period = ridge_period_px(np.asarray(zoomed, np.uint8))
    return None if period is None else period / zoom


def ridge_period_px(pixels: Grey) -> float | None:
    """Return the median distance of ridges in pixels, None where it is not clear."""
    if min(pixels.shape) < _WINDOW_PX:
        return None
    height, width = (size - _WINDOW_PX for size in pixels.shape)
    step = _WINDOW_PX // 2
    while (height // step + 1) * (width // step + 1) > _MAX_WINDOWS:
        step += max(1, step // 4)
    view = np.lib.stride_tricks.sliding_window_view(pixels, (_WINDOW_PX, _WINDOW_PX))
    windows = view[::step, ::step].reshape(-1, _WINDOW_PX, _WINDOW_PX)
    contrast = windows[:, ::2, ::2].std(axis=(1, 2), dtype=np.float32)
    clear = contrast > max(1.0, _LEAST_CONTRAST * float(percentiles(contrast, 90)[0]))
    if clear.sum() < _LEAST_WINDOWS:
        return None
    distances = _periods(windows[clear][:: -(-int(clear.sum()) // _MAX_CLEAR)])
    if len(distances) < _LEAST_WINDOWS:
        return None
    low, middle, high = percentiles(distances, 20, 50, 80).tolist()
    return float(middle) if high <= _MOST_SPREAD * low else None


def _periods(windows: Grey) -> Floats:
    """Return the periods of the windows in which one wave has much of the energy."""
    values = windows - windows.mean(axis=(1, 2), keepdims=True, dtype=np.float32)
    values *= _TAPER
    values -= values.mean(axis=(1, 2), keepdims=True)
    padded = np.zeros((_SPECTRUM_PX, _SPECTRUM_PX), np.float32)
    energy = np.empty((len(values), *_WEIGHT.shape), np.float32)
    for window, spectrum in zip(values, energy, strict=True):
        padded[:_WINDOW_PX, :_WINDOW_PX] = window
        wave = cv2.dft(padded, flags=cv2.DFT_COMPLEX_OUTPUT, nonzeroRows=_WINDOW_PX)
        np.einsum("ijk,ijk->ij", *(2 * [wave[:, : spectrum.shape[1]]]), out=spectrum)
    energy *= _WEIGHT
    flat = energy.reshape(len(energy), -1)
    y, x = np.divmod(flat.argmax(axis=1)[:, None], energy.shape[2])
    rows, columns = (y + _DISC[0]) % _SPECTRUM_PX, x + _DISC[1]
    inside = (columns >= 0) & (columns < energy.shape[2])
    columns = np.where(inside, columns, 0)
    near = energy[np.arange(len(energy))[:, None], rows, columns] * inside
    clear = near.sum(axis=1) > _LEAST_SHARE * flat.sum(axis=1)
    period = 1.0 / np.maximum(_RADIUS[rows, columns][clear], 1.0 / _SPECTRUM_PX)
    near = near[clear] * period
    return np.asarray((near * period).sum(axis=1) / near.sum(axis=1))


def _within(value: float, span: tuple[float, float]) -> bool:
    return span[0] <= value <= span[1]

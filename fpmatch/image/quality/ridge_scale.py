"""Ridge scale: whether the distance of the ridges contradicts the resolution that a file gives.

Programs that edit or photograph write resolutions of their own into a file (72, 96, 180, 200, 300).
The ridges of a finger lie 0.3 to 0.6 mm apart, in the median of a print. The period is measured in
pixels, in windows where one wave has much of the energy. A resolution cannot be right if it puts
the period far outside that range, while 500 dpi puts it inside.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.templates.minutiae import MM_PER_INCH, STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.image.arrays import Floats, Grey

PERIODS_MM: Final = (0.26, 0.7)
"""Least and largest median period of a print that is believed: a child's, a large hand's."""

USUAL_DPI: Final = (450.0, 600.0)
"""Resolutions of live scanners and scanned cards, which are not questioned."""

_STANDARD_MM: Final = (0.3, 0.65)  # a clear period of a print at 500 dpi
_WINDOW_PX: Final = 64
_SPECTRUM_PX: Final = 128
_PERIODS_PX: Final = (2.6, 30.0)
_MAX_WINDOWS: Final = 128
_BATCH: Final = 32  # windows at a time
_LEAST_CONTRAST: Final = 0.35  # of that of the clearest windows
_PEAK_RADIUS: Final = 0.022  # cycles a pixel
_LEAST_SHARE: Final = 0.2  # of a window's energy in its strongest wave
_LEAST_WINDOWS: Final = 4
_MOST_SPREAD: Final = 1.4  # ratio of the 80th to the 20th percentile of the periods


class _Waves(NamedTuple):
    """The spectrum's plane: frequencies and radius in cycles a pixel, and weights."""

    x: Floats
    y: Floats
    radius: Floats
    weight: Floats  # flattens the spectrum of anything but ridges; 0 outside the periods
    taper: Floats  # of a window


def contradiction(pixels: Grey, dpi: float) -> str:
    """Return what contradicts a resolution of grey values (H, W), "" where nothing clearly does."""
    if USUAL_DPI[0] <= dpi <= USUAL_DPI[1]:
        return ""
    period = ridge_period_px(pixels)
    if period is None or not _within(period * MM_PER_INCH / STANDARD_DPI, _STANDARD_MM):
        return ""
    apart = period * MM_PER_INCH / dpi
    if _within(apart, PERIODS_MM):
        return ""
    return f"at its resolution of {dpi:g} dpi ridges would be {apart:.2g} mm apart: ignored"


def ridge_period_px(pixels: Grey) -> float | None:
    """Return the median distance of ridges in pixels, None where it is not clear."""
    if min(pixels.shape) < _WINDOW_PX:
        return None
    windows = _windows(pixels)
    contrast = windows.std(axis=(1, 2), dtype=np.float64)
    clear = contrast > max(1.0, _LEAST_CONTRAST * float(np.quantile(contrast, 0.9)))
    periods = [_periods(windows[clear][k : k + _BATCH]) for k in range(0, clear.sum(), _BATCH)]
    distances = np.concatenate(periods) if periods else np.empty(0)
    if len(distances) < _LEAST_WINDOWS:
        return None
    low, middle, high = np.quantile(distances, [0.2, 0.5, 0.8]).tolist()
    return float(middle) if high <= _MOST_SPREAD * low else None


def _windows(pixels: Grey) -> Grey:
    """Return windows all over an image, (K, side, side)."""
    height, width = (size - _WINDOW_PX for size in pixels.shape)
    step = _WINDOW_PX // 2
    while (height // step + 1) * (width // step + 1) > _MAX_WINDOWS:
        step += max(1, step // 4)
    view = np.lib.stride_tricks.sliding_window_view(pixels, (_WINDOW_PX, _WINDOW_PX))
    return np.asarray(view[::step, ::step].reshape(-1, _WINDOW_PX, _WINDOW_PX))


def _periods(windows: Grey) -> Floats:
    """Return the periods of the windows in which one wave has much of the energy."""
    waves = _waves()
    values = windows - windows.mean(axis=(1, 2), keepdims=True, dtype=np.float32)
    values *= waves.taper
    values -= values.mean(axis=(1, 2), keepdims=True)
    size = (_SPECTRUM_PX, _SPECTRUM_PX)
    energy = (np.abs(np.fft.rfft2(values, s=size)) ** 2 * waves.weight).astype(np.float32)
    peak = energy.reshape(len(energy), -1).argmax(axis=1)
    x, y = (plane.ravel()[peak][:, None, None] for plane in (waves.x, waves.y))
    near = (waves.x - x) ** 2 + (waves.y - y) ** 2 < _PEAK_RADIUS**2
    total = energy.sum(axis=(1, 2))
    share = (energy * near).sum(axis=(1, 2)) / np.maximum(total, np.finfo(np.float32).tiny)
    return np.asarray(1.0 / waves.radius.ravel()[peak[share > _LEAST_SHARE]])


@cache
def _waves() -> _Waves:
    y, x = np.meshgrid(np.fft.fftfreq(_SPECTRUM_PX), np.fft.rfftfreq(_SPECTRUM_PX), indexing="ij")
    radius = np.hypot(x, y)
    inside = (radius > 1.0 / _PERIODS_PX[1]) & (radius < 1.0 / _PERIODS_PX[0])
    taper = np.hanning(_WINDOW_PX + 2)[1:-1].astype(np.float32)
    weight = np.where(inside, radius**2, 0.0)
    planes = (x, y, radius, weight, np.outer(taper, taper))
    return _Waves(*(plane.astype(np.float32) for plane in planes))


def _within(value: float, span: tuple[float, float]) -> bool:
    return span[0] <= value <= span[1]

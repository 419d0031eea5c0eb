"""The local ridge spectrum: the energy of each neighbourhood by wave angle and period.

A windowed Fourier transform at the centre of every block, after Chikkerur, Cartwright, Govindaraju,
"Fingerprint enhancement using STFT analysis", Pattern Recognition 40 (2007), but sampled in polar
coordinates. Segmentation, ridge orientation and ridge period are derived from it.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.image.preprocess.arrays import BLOCK_PX

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats

# Lengths in pixels at 500 dpi.
WINDOW_SIGMA_PX: Final = 8.0
WINDOW_RADIUS_PX: Final = 16
# Ridge orientations (radians, counter-clockwise on screen from +x) and periods of the waves.
ANGLES: Final = np.arange(16) * (np.pi / 16)
PERIODS_PX: Final = np.array([5.0, 5.9, 6.9, 8.0, 9.3, 10.9, 12.8, 15.0])
_BAND_ROWS: Final = 16  # rows of blocks at a time: memory does not grow with the image's height


class RidgeSpectrum(NamedTuple):
    """The energies in the windowed neighbourhood of each block, (rows, columns)."""

    energy: Floats  # of the wave of each of `ANGLES` and `PERIODS_PX`, (rows, columns, A, F)
    total: Floats  # of all, (rows, columns); a pure wave has ``energy = total``


def ridge_spectrum(pixels: Floats) -> RidgeSpectrum:
    """Measure the local ridge spectrum of a normalized image (H, W), 0 where invalid."""
    waves, window = _waves()
    half = waves.shape[1] // 2
    radius, side = WINDOW_RADIUS_PX, 2 * WINDOW_RADIUS_PX + 1
    before = radius - BLOCK_PX // 2
    padded = np.pad(pixels, [(before, -size % BLOCK_PX + radius + 1) for size in pixels.shape])
    windows = np.lib.stride_tricks.sliding_window_view(padded, (side, side))
    grid = windows[: pixels.shape[0] : BLOCK_PX, : pixels.shape[1] : BLOCK_PX]  # of each block
    rows, columns = grid.shape[:2]
    energy = np.zeros((rows, columns, half), np.float32)
    total = np.zeros((rows, columns), np.float32)
    for band in range(0, rows, _BAND_ROWS):
        patches = grid[band : band + _BAND_ROWS].reshape(-1, len(window))
        power = (patches * patches) @ window
        filled = np.flatnonzero(power > 0)  # background costs nothing
        projection = patches[filled] @ waves
        total[band : band + _BAND_ROWS] = power.reshape(-1, columns)
        energy[band : band + _BAND_ROWS].reshape(-1, half)[filled] = 2.0 * (
            projection[:, :half] ** 2 + projection[:, half:] ** 2
        )
    return RidgeSpectrum(energy.reshape(rows, columns, len(ANGLES), -1), total)


@cache
def _waves() -> tuple[Floats, Floats]:
    """Return the windowed waves (cosines, then sines; shape (side², 2·A·F)) and the window²."""
    r = np.arange(-WINDOW_RADIUS_PX, WINDOW_RADIUS_PX + 1, dtype=np.float64)
    x, y = np.meshgrid(r, r)
    window = np.exp(-(x * x + y * y) / (2 * WINDOW_SIGMA_PX**2))
    window /= np.sqrt((window**2).sum())
    across = -(x * np.sin(ANGLES)[:, None, None] + y * np.cos(ANGLES)[:, None, None])
    phase = 2 * np.pi * across[:, None] / PERIODS_PX[:, None, None]
    energy_window = window**2
    waves = []
    for wave in (np.cos(phase), np.sin(phase)):
        mean = (wave * energy_window).sum(axis=(-2, -1), keepdims=True)
        waves.append((wave - mean) * energy_window)
    stacked = np.concatenate([w.reshape(-1, r.size**2) for w in waves])
    return np.ascontiguousarray(stacked.T, np.float32), energy_window.ravel().astype(np.float32)

"""The local ridge spectrum: the energy of each neighbourhood by wave angle and period.

A windowed Fourier transform on a coarse grid, sampled in polar coordinates; segmentation, ridge
orientation and ridge period are derived from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BAND_ROWS: Final = 16  # rows of blocks at a time: memory does not grow with the image's height


@dataclass(frozen=True, slots=True)
class SpectrumParameters:
    """Set the windowed Fourier transform; lengths in pixels at 500 dpi."""

    step_px: int = 8
    window_sigma_px: float = 8.0
    window_radius_px: int = 16
    angles: int = 16
    periods_px: tuple[float, ...] = (5.0, 5.9, 6.9, 8.0, 9.3, 10.9, 12.8, 15.0)


@dataclass(frozen=True, slots=True)
class RidgeSpectrum:
    """Hold the local spectrum on a grid of blocks.

    Parameters
    ----------
    step_px : int
        Side of a block; block ``[i, j]`` is centred at pixel ``((j + 0.5)·step, (i + 0.5)·step)``.
    shape : tuple of int
        Height and width of the image.
    angles : ndarray of float32, shape (A,)
        Ridge orientations in [0, π), counter-clockwise on screen from +x.
    periods : ndarray of float32, shape (F,)
        Ridge periods in pixels.
    energy : ndarray of float32, shape (rows, columns, A, F)
        Energy of the wave of each orientation and period in the windowed neighbourhood.
    total : ndarray of float32, shape (rows, columns)
        Whole energy of the windowed neighbourhood; a pure wave has ``energy = total``.
    """

    step_px: int
    shape: tuple[int, int]
    angles: NDArray[np.float32]
    periods: NDArray[np.float32]
    energy: NDArray[np.float32]
    total: NDArray[np.float32]


def ridge_spectrum(
    pixels: NDArray[np.float32], parameters: SpectrumParameters | None = None
) -> RidgeSpectrum:
    """Measure the local ridge spectrum of a normalized image (H, W), 0 where invalid.

    References
    ----------
    Chikkerur, Cartwright, Govindaraju, "Fingerprint enhancement using STFT analysis", Pattern
    Recognition 40 (2007), with the spectrum sampled on a polar grid.
    """
    p = parameters or SpectrumParameters()
    height, width = pixels.shape
    rows, columns = -(-height // p.step_px), -(-width // p.step_px)
    waves, window = _waves(p)
    half = waves.shape[1] // 2
    energy = np.zeros((rows, columns, half), np.float32)
    total = np.zeros((rows, columns), np.float32)
    grid = _neighbourhoods(pixels, rows, columns, p)
    for band in range(0, rows, _BAND_ROWS):
        patches = grid[band : band + _BAND_ROWS].reshape(-1, len(window))
        power = (patches * patches) @ window
        filled = np.flatnonzero(power > 0)  # background costs nothing
        projection = patches[filled] @ waves
        total[band : band + _BAND_ROWS] = power.reshape(-1, columns)
        energy[band : band + _BAND_ROWS].reshape(-1, half)[filled] = 2.0 * (
            projection[:, :half] ** 2 + projection[:, half:] ** 2
        )
    return RidgeSpectrum(
        step_px=p.step_px,
        shape=(height, width),
        angles=(np.arange(p.angles) * (np.pi / p.angles)).astype(np.float32),
        periods=np.asarray(p.periods_px, np.float32),
        energy=energy.reshape(rows, columns, p.angles, -1),
        total=total,
    )


def _neighbourhoods(
    pixels: NDArray[np.float32], rows: int, columns: int, p: SpectrumParameters
) -> NDArray[np.float32]:
    """Return a view of the neighbourhood of each block, shape (rows, columns, side, side)."""
    height, width = pixels.shape
    radius, side = p.window_radius_px, 2 * p.window_radius_px + 1
    before = radius - p.step_px // 2
    padded = np.pad(
        pixels,
        (
            (before, rows * p.step_px - height + radius + 1),
            (before, columns * p.step_px - width + radius + 1),
        ),
    )
    windows = np.lib.stride_tricks.sliding_window_view(padded, (side, side))
    return windows[: rows * p.step_px : p.step_px, : columns * p.step_px : p.step_px]


@lru_cache(maxsize=4)
def _waves(p: SpectrumParameters) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the windowed waves (cosines, then sines; shape (side², 2·A·F)) and the window²."""
    r = np.arange(-p.window_radius_px, p.window_radius_px + 1, dtype=np.float64)
    x, y = np.meshgrid(r, r)
    window = np.exp(-(x * x + y * y) / (2 * p.window_sigma_px**2))
    window /= np.sqrt((window**2).sum())
    angles = np.arange(p.angles) * (np.pi / p.angles)
    across = -(x * np.sin(angles)[:, None, None] + y * np.cos(angles)[:, None, None])
    phase = 2 * np.pi * across[:, None] / np.asarray(p.periods_px)[:, None, None]
    energy_window = window**2
    waves = []
    for wave in (np.cos(phase), np.sin(phase)):
        mean = (wave * energy_window).sum(axis=(-2, -1), keepdims=True)
        waves.append((wave - mean) * energy_window)
    stacked = np.concatenate([w.reshape(-1, r.size**2) for w in waves])
    return np.ascontiguousarray(stacked.T, np.float32), energy_window.ravel().astype(np.float32)

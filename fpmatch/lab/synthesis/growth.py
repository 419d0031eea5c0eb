"""The ridge pattern of a master print, grown from random seeds by oriented filtering.

References
----------
Cappelli, Erol, Maio, Maltoni, "Synthetic fingerprint-image generation", ICPR 2000 (SFinGe).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Field = NDArray[np.float32]  # a value a pixel
    Taps = list[tuple[NDArray[np.intp], np.float32]]  # flat pixel indices, and their weight

_STEPS: Final = 2.0**20  # of cosines and weights, which are rounded so that machines agree

# Lengths are ridge periods.
ACROSS_SIGMA: Final = 0.45  # width of the oriented filter
ALONG_SIGMA, ALONG_REACH = 0.6, 1.6
TAPS: Final = 8  # on either side, across and along
SEEDS_PER_SQUARE_PERIOD: Final = 0.7
STEPS: Final = 18  # enough to fill the print; more remove minutiae
GAIN: Final = 3.0  # before clipping to -1..1; more grows faster
BLUR: Final = 0.08  # weight of a neighbour; hides the rounding of taps to pixels
DOT: Final = 0.6  # largest area of a spot or hole that is smoothed away, periods squared
SETTLING_STEPS: Final = 3  # steps after that


def grow_ridges(orientation: Field, period: Field, rng: np.random.Generator) -> Field:
    """Grow ridges along an orientation field until they fill the print.

    `orientation` is in radians, counter-clockwise on screen, `period` in pixels, both (H, W). The
    Gabor-like filter is separable in the local frame: a cosine under a Gaussian across the ridges,
    then a Gaussian along them, each a weighted sum of nearest pixels. Returns the relief (H, W),
    from -1 in the valleys to 1 on the ridges.
    """
    across, along = _filters(orientation, period)
    relief = np.zeros(orientation.size, np.float32)
    mean_period = float(np.mean(period, dtype=np.float64))
    seeds = int(SEEDS_PER_SQUARE_PERIOD * relief.size / mean_period**2)
    relief[rng.integers(0, relief.size, max(seeds, 1))] = 1.0
    gain, blur = np.float32(GAIN), np.float32(BLUR)
    own = 1 - 2 * blur
    for step in range(STEPS):
        if STEPS - step == SETTLING_STEPS:
            smooth = without_dots_and_holes(relief.reshape(orientation.shape), DOT * period**2)
            relief = smooth.ravel()
        relief = np.clip(gain * relief, -1, 1)
        relief = _weighted_sum(_weighted_sum(relief, across), along)
        padded = np.pad(relief.reshape(orientation.shape), 1, mode="edge")
        padded = own * padded[1:-1] + blur * (padded[:-2] + padded[2:])
        relief = (own * padded[:, 1:-1] + blur * (padded[:, :-2] + padded[:, 2:])).ravel()
    return np.asarray(np.clip(relief.reshape(orientation.shape), -1, 1))


def without_dots_and_holes(relief: Field, largest_px: Field) -> Field:
    """Invert dots of ridge and holes in ridges in a relief, (H, W), positive on ridges.

    `largest_px` (H, W) is the area in pixels below which a spot is a dot or a hole.
    """
    from scipy import ndimage  # noqa: PLC0415

    ridges, _ = ndimage.label(relief > 0, np.ones((3, 3)))  # joined at corners
    dots = (ridges > 0) & (np.bincount(ridges.ravel())[ridges] < largest_px)
    cleaned = np.where(dots, -relief, relief)
    valleys, _ = ndimage.label(cleaned <= 0)  # not joined at corners
    holes = (valleys > 0) & (np.bincount(valleys.ravel())[valleys] < largest_px)
    return np.asarray(np.where(holes, -cleaned, cleaned), np.float32)


def _filters(orientation: Field, period: Field) -> tuple[Taps, Taps]:
    """Return the taps across the ridges and along them."""
    dx, dy = period * _rounded(np.cos(orientation)), period * _rounded(np.sin(orientation))
    x = np.linspace(-1, 1, 2 * TAPS + 1)
    wave, envelope = np.cos(2 * np.pi * x), np.exp(-0.5 * (x / ACROSS_SIGMA) ** 2)
    blind = envelope * (wave - envelope @ wave / envelope.sum())  # to a uniform level
    across = _taps(-dy, dx, x, blind / (blind @ wave))
    x = np.linspace(-ALONG_REACH, ALONG_REACH, 2 * TAPS + 1)
    envelope = np.exp(-0.5 * (x / ALONG_SIGMA) ** 2)
    return across, _taps(dx, dy, x, envelope / envelope.sum())


def _taps(
    dx: Field, dy: Field, distances: NDArray[np.float64], weights: NDArray[np.float64]
) -> Taps:
    """Return the nearest pixels at the given distances along (dx, dy), y up, from every pixel."""
    rows, columns = dx.shape
    y, x = np.mgrid[:rows, :columns].astype(np.float32)
    taps = []
    for distance, weight in zip(_rounded(distances), _rounded(weights), strict=True):
        column = np.clip(np.rint(x + distance * dx), 0, columns - 1)
        row = np.clip(np.rint(y - distance * dy), 0, rows - 1)
        taps.append(((row * columns + column).astype(np.intp).ravel(), weight))
    return taps


def _rounded(values: NDArray[np.floating]) -> Field:
    return np.asarray(np.rint(values * _STEPS) / _STEPS, np.float32)


def _weighted_sum(values: Field, taps: Taps) -> Field:
    total = np.zeros_like(values)
    for pixel, weight in taps:
        total += weight * values[pixel]
    return total

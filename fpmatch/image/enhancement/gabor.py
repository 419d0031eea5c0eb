"""Gabor filters: every pixel is filtered along its ridge, which suppresses noise.

Hong, Wan, Jain, "Fingerprint image enhancement: algorithm and performance evaluation", PAMI 20
(1998).
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.enhancement import _oriented_filter_kernel as kernel

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats, Ints, Mask

# Lengths in pixels at 500 dpi.
ANGLES: Final = 32
PERIODS_PX: Final = (5.5, 6.3, 7.2, 8.2, 9.3, 10.5, 11.9, 13.4, 15.0)
RADIUS_PX: Final = 12
ALONG_SIGMA_PX: Final = 5.0
ACROSS_SIGMA_PERIODS: Final = 0.42


def gabor_filter(pixels: Floats, mask: Mask, orientation: Floats, period: Floats) -> Floats:
    """Filter each pixel of the mask with the Gabor filter of its orientation and period.

    All arrays are (H, W): normalized image with positive ridges, mask, ridge orientation (radians,
    counter-clockwise from +x) and ridge period (pixels). The result is 0 outside the mask.
    """
    if not pixels.shape == mask.shape == orientation.shape == period.shape:
        raise ValueError("pixels, mask, orientation and period must have one shape")
    y, x = np.nonzero(mask)
    angle_index = np.rint(orientation[y, x] * (ANGLES / np.pi)).astype(np.int64) % ANGLES
    edges = np.sqrt(np.multiply(PERIODS_PX[:-1], PERIODS_PX[1:]))
    period_index = np.searchsorted(edges, period[y, x])
    which = (angle_index * len(PERIODS_PX) + period_index).astype(np.int32)
    margins = ((RADIUS_PX, RADIUS_PX), (RADIUS_PX, kernel.ROW))
    padded = np.pad(np.ascontiguousarray(pixels, np.float32), margins)
    out = np.zeros(pixels.shape, np.float32)
    filter_listed = kernel.filter_pixels if kernel.COMPILED else filter_with_numpy
    filter_listed(padded, y.astype(np.int32), x.astype(np.int32), which, filter_bank(), out)
    return out


def filter_with_numpy(
    padded: Floats, y: Ints, x: Ints, which: Ints, bank: Floats, out: Floats
) -> None:
    """Filter as the kernel does: the uncompiled path, and the kernel's oracle."""
    windows = np.lib.stride_tricks.sliding_window_view(padded, bank.shape[1:])
    if not len(which):
        return
    order = np.argsort(which, kind="stable")
    used, starts = np.unique(which[order], return_index=True)
    for index, members in zip(used, np.split(order, starts[1:]), strict=True):
        neighbourhoods = windows[y[members], x[members]].reshape(len(members), -1)
        out[y[members], x[members]] = neighbourhoods @ bank[index].ravel()


@cache
def filter_bank() -> Floats:
    """Return the filters, (angles·periods, side, kernel.ROW), of zero mean and unit gain."""
    r = np.arange(-RADIUS_PX, RADIUS_PX + 1, dtype=np.float64)
    x, y = np.meshgrid(r, r)
    bank = np.zeros((ANGLES * len(PERIODS_PX), r.size, kernel.ROW), np.float32)
    for a in range(ANGLES):
        angle = a * np.pi / ANGLES
        along = x * np.cos(angle) - y * np.sin(angle)
        across = x * np.sin(angle) + y * np.cos(angle)
        for f, period in enumerate(PERIODS_PX):
            sigma = ACROSS_SIGMA_PERIODS * period
            window = np.exp(-((along / ALONG_SIGMA_PX) ** 2 + (across / sigma) ** 2) / 2)
            wave = np.cos(2 * np.pi * across / period)
            gabor = window * (wave - (window * wave).sum() / window.sum())
            bank[a * len(PERIODS_PX) + f, :, : r.size] = gabor / (gabor * wave).sum()
    return bank

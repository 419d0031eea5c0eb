"""Gabor filters: every pixel is filtered along its ridge, by the local orientation and period.

Hong, Wan, Jain, "Fingerprint image enhancement: algorithm and performance evaluation", PAMI 20
(1998).
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.spectrum import ANGLES, PERIODS_PX

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats, Mask, OrientationField
    from fpmatch.image.preprocess.spectrum import RidgeSpectrum

PERIOD_SMOOTHING_BLOCKS: Final = 2.0
ANGLE_SHARPNESS: Final = 8.0
PEAK_POWER: Final = 3.0
_NO_ENERGY: Final = 1e-9  # share of the local energy, summed over the angles

# Of the filters; lengths in pixels at 500 dpi.
FILTER_ANGLES: Final = 32
FILTER_PERIODS_PX: Final = (5.5, 6.3, 7.2, 8.2, 9.3, 10.5, 11.9, 13.4, 15.0)
RADIUS_PX: Final = 12
ALONG_SIGMA_PX: Final = 5.0
ACROSS_SIGMA_PERIODS: Final = 0.42


def doubled_angles(spectrum: RidgeSpectrum, mask: Mask) -> Floats:
    """Return cosine and sine of the doubled angle of the ridges, and weight, (rows, columns, 3).

    They are means over the energies of the local spectrum. The weight is 0 outside the mask, so
    that blocks there do not influence those inside.
    """
    weight = (mask / (spectrum.total + 1e-3)).astype(np.float32)
    by_angle = (spectrum.energy * weight[..., None, None]).sum(axis=3)
    doubled = 2.0 * ANGLES.astype(np.float32)
    parts = (by_angle @ np.cos(doubled), by_angle @ np.sin(doubled), by_angle.sum(axis=2))
    return np.stack(parts, axis=2)


def ridge_period(spectrum: RidgeSpectrum, field: OrientationField, mask: Mask) -> Floats:
    """Estimate the local ridge period, in pixels, of each block (rows, columns).

    The energies of the waves along the local orientation, averaged over the neighbourhood, are
    taken as a distribution over log-period, whose peak is the period. It lies within the range of
    periods that the spectrum samples.
    """
    turn = 2.0 * (ANGLES.astype(np.float32) - field.orientation[..., None])
    along = np.exp(ANGLE_SHARPNESS * (np.cos(turn) - 1.0)) * mask[..., None]
    weight = along / (spectrum.total + 1e-3)[..., None]
    by_period = np.einsum("ijaf,ija->ijf", spectrum.energy, weight)
    blurred = cv2.GaussianBlur(
        by_period, (0, 0), PERIOD_SMOOTHING_BLOCKS, borderType=cv2.BORDER_REPLICATE
    )
    blurred[blurred.max(axis=2) < _NO_ENERGY] = 1.0  # no evidence: all periods are equally likely
    peaked = (blurred / blurred.max(axis=2, keepdims=True)) ** PEAK_POWER
    log_periods = np.log(PERIODS_PX.astype(np.float32))
    return np.asarray(np.exp((peaked @ log_periods) / peaked.sum(axis=2)), np.float32)


def gabor_filter(pixels: Floats, mask: Mask, orientation: Floats, period: Floats) -> Floats:
    """Filter each pixel of the mask with the Gabor filter of its orientation and period.

    All arrays are (H, W): normalized image with positive ridges, mask, ridge orientation (radians,
    counter-clockwise from +x) and ridge period (pixels). The result is 0 outside the mask.
    """
    if not pixels.shape == mask.shape == orientation.shape == period.shape:
        raise ValueError("pixels, mask, orientation and period must have one shape")
    y, x = np.nonzero(mask)
    out = np.zeros(pixels.shape, np.float32)
    steps = np.rint(orientation[y, x] * (FILTER_ANGLES / np.pi)).astype(np.int64)
    edges = np.sqrt(np.multiply(FILTER_PERIODS_PX[:-1], FILTER_PERIODS_PX[1:]))
    which = steps % FILTER_ANGLES * len(FILTER_PERIODS_PX) + np.searchsorted(edges, period[y, x])
    side = 2 * RADIUS_PX + 1
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(pixels, RADIUS_PX), (side, side))
    order = np.argsort(which, kind="stable")
    used, starts = np.unique(which[order], return_index=True)
    for index, members in zip(used, np.split(order, starts[1:]), strict=False):
        neighbourhoods = windows[y[members], x[members]].reshape(len(members), -1)
        out[y[members], x[members]] = neighbourhoods @ filter_bank()[index].ravel()
    return out


@cache
def filter_bank() -> Floats:
    """Return the filters, (angles·periods, side, side), of zero mean and unit gain."""
    r = np.arange(-RADIUS_PX, RADIUS_PX + 1, dtype=np.float64)
    x, y = np.meshgrid(r, r)
    bank = np.zeros((FILTER_ANGLES * len(FILTER_PERIODS_PX), r.size, r.size), np.float32)
    for a in range(FILTER_ANGLES):
        angle = a * np.pi / FILTER_ANGLES
        along = x * np.cos(angle) - y * np.sin(angle)
        across = x * np.sin(angle) + y * np.cos(angle)
        for f, period in enumerate(FILTER_PERIODS_PX):
            sigma = ACROSS_SIGMA_PERIODS * period
            window = np.exp(-((along / ALONG_SIGMA_PX) ** 2 + (across / sigma) ** 2) / 2)
            wave = np.cos(2 * np.pi * across / period)
            gabor = window * (wave - (window * wave).sum() / window.sum())
            bank[a * len(FILTER_PERIODS_PX) + f] = gabor / (gabor * wave).sum()
    return bank

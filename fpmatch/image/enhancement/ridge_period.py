"""Local ridge period: the distance from one ridge to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.preprocess.blocks import blur_blocks
from fpmatch.image.preprocess.spectrum import ANGLES, PERIODS_PX

if TYPE_CHECKING:
    from fpmatch.image.arrays import Floats, Mask
    from fpmatch.image.enhancement.orientation import OrientationField
    from fpmatch.image.preprocess.spectrum import RidgeSpectrum

SMOOTHING_BLOCKS: Final = 2.0
ANGLE_SHARPNESS: Final = 8.0
PEAK_POWER: Final = 3.0
_NO_ENERGY: Final = 1e-9  # share of the local energy, summed over the angles


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
    blurred = blur_blocks(by_period, SMOOTHING_BLOCKS)
    blurred[blurred.max(axis=2) < _NO_ENERGY] = 1.0  # no evidence: all periods are equally likely
    peaked = (blurred / blurred.max(axis=2, keepdims=True)) ** PEAK_POWER
    log_periods = np.log(PERIODS_PX.astype(np.float32))
    return np.asarray(np.exp((peaked @ log_periods) / peaked.sum(axis=2)), np.float32)

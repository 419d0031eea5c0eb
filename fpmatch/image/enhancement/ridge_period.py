"""Local ridge period: the distance from one ridge to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.preprocess.blocks import blur_blocks

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.enhancement.orientation import OrientationField
    from fpmatch.image.enhancement.spectrum import RidgeSpectrum

_NO_ENERGY: Final = 1e-9  # share of the local energy, summed over the angles


@dataclass(frozen=True, slots=True)
class PeriodParameters:
    """Set the estimate of the ridge period; lengths in blocks (8 px at 500 dpi)."""

    smoothing_blocks: float = 2.0
    angle_sharpness: float = 8.0
    peak_power: float = 3.0


def ridge_period(
    spectrum: RidgeSpectrum,
    field: OrientationField,
    mask: NDArray[np.bool_],
    parameters: PeriodParameters | None = None,
) -> NDArray[np.float32]:
    """Estimate the local ridge period, in pixels, of each block (rows, columns).

    The energies of the waves along the local orientation, averaged over the neighbourhood, are
    taken as a distribution over log-period, whose peak is the period. It lies within the range of
    periods that the spectrum samples.
    """
    p = parameters or PeriodParameters()
    turn = 2.0 * (spectrum.angles - field.orientation[..., None])
    along = np.exp(p.angle_sharpness * (np.cos(turn) - 1.0)) * mask[..., None]
    weight = along / (spectrum.total + 1e-3)[..., None]
    by_period = np.einsum("ijaf,ija->ijf", spectrum.energy, weight)
    blurred = blur_blocks(by_period, p.smoothing_blocks)
    blurred[blurred.max(axis=2) < _NO_ENERGY] = 1.0  # no evidence: all periods are equally likely
    peaked = (blurred / blurred.max(axis=2, keepdims=True)) ** p.peak_power
    log_period = (peaked @ np.log(spectrum.periods)) / peaked.sum(axis=2)
    return np.asarray(np.exp(log_period), np.float32)

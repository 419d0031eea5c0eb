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
    """Estimate the local ridge period from the local spectrum.

    The energies of the waves that run along the local orientation, averaged over the
    neighbourhood, are read as a distribution over log-period whose peak is the period.

    Parameters
    ----------
    spectrum : RidgeSpectrum
        Local ridge spectrum.
    field : OrientationField
        Local ridge orientation on the same blocks.
    mask : ndarray of bool, shape (rows, columns)
        Segmentation mask on the same blocks.
    parameters : PeriodParameters, optional
        Smoothing.

    Returns
    -------
    ndarray of float32, shape (rows, columns)
        Period in pixels, within the range that the spectrum samples.

    Examples
    --------
    >>> from fpmatch.image.enhancement.orientation import ridge_orientation
    >>> from fpmatch.image.enhancement.spectrum import ridge_spectrum
    >>> x = np.arange(96, dtype=np.float32)
    >>> spectrum = ridge_spectrum(np.tile(np.cos(2 * np.pi * x / 9), (96, 1)))
    >>> mask = np.ones((12, 12), bool)
    >>> field = ridge_orientation(spectrum, mask)
    >>> bool(abs(ridge_period(spectrum, field, mask)[6, 6] - 9) < 0.5)
    True
    """
    p = parameters or PeriodParameters()
    turn = 2.0 * (spectrum.angles - field.orientation[..., None])
    along = np.exp(p.angle_sharpness * (np.cos(turn) - 1.0)) * mask[..., None]
    weight = along / (spectrum.total + 1e-3)[..., None]
    by_period = np.einsum("ijaf,ija->ijf", spectrum.energy, weight)
    blurred = blur_blocks(by_period, p.smoothing_blocks)
    blurred[blurred.max(axis=2) < _NO_ENERGY] = 1.0  # nothing to tell: all periods alike
    peaked = (blurred / blurred.max(axis=2, keepdims=True)) ** p.peak_power
    log_period = (peaked @ np.log(spectrum.periods)) / peaked.sum(axis=2)
    return np.asarray(np.exp(log_period), np.float32)

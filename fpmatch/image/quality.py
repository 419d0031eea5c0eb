"""Quality of a minutia: how well the ridges that were found describe the image around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class QualityParameters:
    """Set the neighbourhood that is compared; length in pixels at 500 dpi."""

    radius_px: int = 14
    sigma_px: float = 8.0


def minutia_quality(
    pixels: NDArray[np.float32],
    enhanced: NDArray[np.float32],
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    parameters: QualityParameters | None = None,
) -> NDArray[np.uint8]:
    """Measure the quality of minutiae as the correlation of the image and its enhancement.

    Parameters
    ----------
    pixels, enhanced : ndarray of float32, shape (H, W)
        Normalised and enhanced image.
    x, y : ndarray of int32, shape (N,)
        Pixels of the minutiae.
    parameters : QualityParameters, optional
        Neighbourhood.

    Returns
    -------
    ndarray of uint8, shape (N,)
        100 times the correlation in a Gaussian neighbourhood; 0 where it is not positive.

    Examples
    --------
    >>> waves = np.tile(np.cos(np.arange(64, dtype=np.float32) * 0.7), (64, 1))
    >>> minutia_quality(waves, 2 * waves, np.array([30]), np.array([30])).tolist()
    [100]
    """
    p = parameters or QualityParameters()
    r = np.arange(-p.radius_px, p.radius_px + 1)
    gauss = np.exp(-(r**2) / (2 * p.sigma_px**2))
    weight = np.outer(gauss, gauss)
    rows = np.asarray(y)[:, None, None] + r[:, None] + p.radius_px
    columns = np.asarray(x)[:, None, None] + r + p.radius_px
    a = np.pad(pixels, p.radius_px)[rows, columns].astype(np.float64)
    b = np.pad(enhanced, p.radius_px)[rows, columns].astype(np.float64)
    cross = (weight * a * b).sum(axis=(1, 2))
    power = (weight * a * a).sum(axis=(1, 2)) * (weight * b * b).sum(axis=(1, 2))
    correlation = cross / np.sqrt(np.maximum(power, 1e-12))
    return np.asarray(np.clip(np.rint(100 * correlation), 0, 100), np.uint8)

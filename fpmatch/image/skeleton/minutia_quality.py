"""Quality of a minutia: how well the ridges that were found describe the image around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.image.skeleton import _correlation_kernel as kernel

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
    gauss = np.exp(-(np.arange(-p.radius_px, p.radius_px + 1) ** 2) / (2 * p.sigma_px**2))
    sums = np.zeros((len(x), 3))
    sum_up = kernel.sum_around if kernel.COMPILED else sum_with_numpy
    a, b = np.asarray(pixels, np.float32), np.asarray(enhanced, np.float32)
    sum_up(a, b, np.asarray(x, np.int32), np.asarray(y, np.int32), gauss, sums)
    cross, power, enhanced_power = sums.T
    correlation = cross / np.sqrt(np.maximum(power * enhanced_power, 1e-12))
    return np.asarray(np.clip(np.rint(100 * correlation), 0, 100), np.uint8)


def sum_with_numpy(
    pixels: NDArray[np.float32],
    enhanced: NDArray[np.float32],
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    weight: NDArray[np.float64],
    sums: NDArray[np.float64],
) -> None:
    """Do as the kernel: the uncompiled path, and its oracle."""
    radius = len(weight) // 2
    rows = y[:, None, None] + np.arange(2 * radius + 1)[:, None]
    columns = x[:, None, None] + np.arange(2 * radius + 1)
    a = np.pad(pixels, radius)[rows, columns].astype(np.float64)
    b = np.pad(enhanced, radius)[rows, columns].astype(np.float64)
    for k, product in enumerate((a * b, a * a, b * b)):
        sums[:, k] = (np.outer(weight, weight) * product).sum(axis=(1, 2))

"""Quality of a minutia: correlation of the image with its enhancement around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class QualityParameters:
    """Set the neighbourhood that is compared; lengths in pixels at 500 dpi."""

    radius_px: int = 14
    sigma_px: float = 8.0


def minutia_quality(
    pixels: NDArray[np.float32],
    enhanced: NDArray[np.float32],
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    parameters: QualityParameters | None = None,
) -> NDArray[np.uint8]:
    """Measure the quality of the minutiae at `x` and `y`, 0 to 100.

    It is 100 times the correlation of the normalised and the enhanced image, both (H, W), in a
    Gaussian neighbourhood; 0 where the correlation is negative.
    """
    p = parameters or QualityParameters()
    offsets = np.arange(-p.radius_px, p.radius_px + 1)
    gauss = np.exp(-(offsets**2) / (2 * p.sigma_px**2))
    weight = np.outer(gauss, gauss).reshape(-1, 1)
    stride = pixels.shape[1] + 2 * p.radius_px
    centre = (y.astype(np.intp) + p.radius_px) * stride + x + p.radius_px
    at = (offsets[:, None] * stride + offsets).reshape(-1, 1) + centre
    a, b = (
        np.pad(image, p.radius_px).ravel().take(at).astype(np.float64)
        for image in (pixels, enhanced)
    )
    cross, power, enhanced_power = (
        _column_sums(weight * product) for product in (a * b, a * a, b * b)
    )
    correlation = cross / np.sqrt(np.maximum(power * enhanced_power, 1e-12))
    return np.asarray(np.clip(np.rint(100 * correlation), 0, 100), np.uint8)


def _column_sums(terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum each column from top to bottom; `sum` adds a single column in another order."""
    sums = terms.cumsum(axis=0)[-1] if terms.shape[1] == 1 else terms.sum(axis=0)
    return np.asarray(sums, np.float64)

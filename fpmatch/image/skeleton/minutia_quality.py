"""Quality of a minutia: correlation of the image with its enhancement around it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Doubles, Floats, Grey, Ints

RADIUS_PX: Final = 14
SIGMA_PX: Final = 8.0


def minutia_quality(pixels: Floats, enhanced: Floats, x: Ints, y: Ints) -> Grey:
    """Measure the quality of the minutiae at `x` and `y`, 0 to 100.

    It is 100 times the correlation of the normalised and the enhanced image, both (H, W), in a
    Gaussian neighbourhood; 0 where the correlation is negative.
    """
    offsets = np.arange(-RADIUS_PX, RADIUS_PX + 1)
    gauss = np.exp(-(offsets**2) / (2 * SIGMA_PX**2))
    weight = np.outer(gauss, gauss).reshape(-1, 1)
    stride = pixels.shape[1] + 2 * RADIUS_PX
    centre = (y.astype(np.intp) + RADIUS_PX) * stride + x + RADIUS_PX
    at = (offsets[:, None] * stride + offsets).reshape(-1, 1) + centre
    a, b = (
        np.pad(one, RADIUS_PX).ravel().take(at).astype(np.float64) for one in (pixels, enhanced)
    )
    cross, power, enhanced_power = (_column_sums(weight * one) for one in (a * b, a * a, b * b))
    correlation = cross / np.sqrt(np.maximum(power * enhanced_power, 1e-12))
    return np.asarray(np.clip(np.rint(100 * correlation), 0, 100), np.uint8)


def _column_sums(terms: Doubles) -> Doubles:
    """Sum each column from top to bottom; `sum` adds a single column in another order."""
    sums = terms.cumsum(axis=0)[-1] if terms.shape[1] == 1 else terms.sum(axis=0)
    return np.asarray(sums, np.float64)

"""Blend of the image and its enhancement, on which orientation is measured again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BlendParameters:
    """Set the blend; lengths in pixels at 500 dpi, amplitudes of the normalized image."""

    rounds: int = 1  # how often orientation and period are measured again on the blend
    enhanced_share: float = 0.5
    window_sigma_px: float = 12.0  # in which the enhanced image is scaled to unit amplitude
    min_amplitude: float = 0.05  # added to the local one, so that noise is not amplified
    clip: float = 2.0  # largest amplitude of the scaled image


def blend(
    pixels: NDArray[np.float32],
    enhanced: NDArray[np.float32],
    mask: NDArray[np.bool_],
    parameters: BlendParameters | None = None,
) -> NDArray[np.float32]:
    """Blend a normalized image (H, W) with its enhancement, scaled to the same local amplitude.

    In gaps by scars, dry or faint skin, the enhanced image continues the ridges around, so that the
    orientation of the blend follows them. The blend is 0 outside the mask.
    """
    p = parameters or BlendParameters()
    power = cv2.GaussianBlur(enhanced * enhanced, (0, 0), p.window_sigma_px)
    evened = enhanced / (np.sqrt(power) + p.min_amplitude)
    mixed = (1 - p.enhanced_share) * pixels + p.enhanced_share * np.clip(evened, -p.clip, p.clip)
    return np.asarray(mixed * mask, np.float32)

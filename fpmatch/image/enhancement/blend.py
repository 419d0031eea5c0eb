"""Blending: the image and its enhancement together, from which orientation is measured again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BlendParameters:
    """Set the blend; lengths in pixels at 500 dpi, amplitudes in those of the normalised image.

    Parameters
    ----------
    rounds : int
        How often orientation and period are measured again on the blend.
    enhanced_share : float
        Share of the enhanced image, 0 to 1.
    window_sigma_px : float
        Window over which the enhanced image is brought to unit amplitude.
    min_amplitude : float
        Amplitude that is added to the local one, so that next to nothing is not blown up.
    clip : float
        Greatest amplitude after that.
    """

    rounds: int = 1
    enhanced_share: float = 0.5
    window_sigma_px: float = 12.0
    min_amplitude: float = 0.05
    clip: float = 2.0


def blend(
    pixels: NDArray[np.float32],
    enhanced: NDArray[np.float32],
    mask: NDArray[np.bool_],
    parameters: BlendParameters | None = None,
) -> NDArray[np.float32]:
    """Blend a normalised image with its enhancement, locally brought to the same amplitude.

    Where scars, dry or faint skin leave gaps, the enhanced image carries the neighbourhood's
    ridges into them; measured on the blend, the orientation there follows the flow around.

    Parameters
    ----------
    pixels : ndarray of float32, shape (H, W)
        Normalised image, ridges positive.
    enhanced : ndarray of float32, shape (H, W)
        Its enhancement.
    mask : ndarray of bool, shape (H, W)
        Segmentation mask; the blend is 0 outside.
    parameters : BlendParameters, optional
        Share and window.

    Returns
    -------
    ndarray of float32, shape (H, W)
        The blend.

    Examples
    --------
    >>> waves = np.tile(np.cos(np.arange(64, dtype=np.float32) * 0.7), (64, 1))
    >>> both = blend(waves, 0.1 * waves, np.ones((64, 64), bool))
    >>> bool(np.corrcoef(both.ravel(), waves.ravel())[0, 1] > 0.99)
    True
    """
    p = parameters or BlendParameters()
    power = cv2.GaussianBlur(enhanced * enhanced, (0, 0), p.window_sigma_px)
    evened = enhanced / (np.sqrt(power) + p.min_amplitude)
    mixed = (1 - p.enhanced_share) * pixels + p.enhanced_share * np.clip(evened, -p.clip, p.clip)
    return np.asarray(mixed * mask, np.float32)

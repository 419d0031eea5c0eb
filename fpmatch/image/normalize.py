"""Local normalisation: every neighbourhood to zero mean and unit contrast, ridges positive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class NormalizationParameters:
    """Set the local normalisation; lengths in pixels at 500 dpi, contrasts in grey levels."""

    window_sigma_px: float = 12.0
    min_contrast: float = 6.0
    flat_window_px: int = 9
    flat_range: int = 3
    min_flat_area_px: int = 400
    clip: float = 3.0


@dataclass(frozen=True, slots=True)
class NormalizedImage:
    """Hold a locally normalised image.

    Parameters
    ----------
    pixels : ndarray of float32, shape (H, W)
        Zero local mean, unit local deviation, ridges (dark skin lines) positive; 0 where invalid.
    contrast : ndarray of float32, shape (H, W)
        Local standard deviation of the grey levels.
    valid : ndarray of bool, shape (H, W)
        False where the sensor delivered nothing: flat areas that reach the border of the image.
    """

    pixels: NDArray[np.float32]
    contrast: NDArray[np.float32]
    valid: NDArray[np.bool_]


def normalize(
    grey: NDArray[np.uint8], parameters: NormalizationParameters | None = None
) -> NormalizedImage:
    """Normalise brightness and contrast locally.

    Flat areas that touch the border (a sensor's frame, white paper) are found first and kept out
    of the local statistics, so that ridges beside them keep their contrast.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Grey image at 500 dpi, ridges dark.
    parameters : NormalizationParameters, optional
        Window and limits.

    Returns
    -------
    NormalizedImage
        Normalised pixels, local contrast, and where the image is valid.

    Examples
    --------
    >>> stripes = np.tile(np.uint8([60, 200]), (64, 32)).repeat(4, axis=1)
    >>> image = normalize(stripes)
    >>> bool(image.pixels[32, 0:4].mean() > 0.5), bool(image.pixels[32, 4:8].mean() < -0.5)
    (True, True)
    """
    p = parameters or NormalizationParameters()
    valid = ~_flat_border(grey, p)
    weight = valid.astype(np.float32)
    share = _blur(weight, p.window_sigma_px) + 1e-6
    values = grey.astype(np.float32) * weight
    mean = _blur(values, p.window_sigma_px) / share
    deviation = (values - mean) * weight
    variance = _blur(deviation * deviation, p.window_sigma_px) / share
    contrast = np.sqrt(variance, dtype=np.float32)
    pixels = np.clip(-deviation / np.maximum(contrast, p.min_contrast), -p.clip, p.clip)
    return NormalizedImage(np.asarray(pixels, np.float32), contrast, valid)


def _flat_border(grey: NDArray[np.uint8], p: NormalizationParameters) -> NDArray[np.bool_]:
    """Return the large areas without any grey-level variation that touch the image's border."""
    box = np.ones((p.flat_window_px, p.flat_window_px), np.uint8)
    spread = cv2.subtract(cv2.dilate(grey, box), cv2.erode(grey, box))
    flat = cv2.dilate((spread <= p.flat_range).astype(np.uint8), box)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(flat, connectivity=4)
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    outside = np.zeros(count, bool)
    outside[border] = stats[border, cv2.CC_STAT_AREA] >= p.min_flat_area_px
    outside[0] = False
    found: NDArray[np.bool_] = outside[labels]
    return found


def _blur(image: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    blurred: NDArray[np.float32] = cv2.GaussianBlur(  # type: ignore[assignment]
        image, (0, 0), sigma, borderType=cv2.BORDER_REFLECT
    )
    return blurred

"""Local normalization: zero mean and unit contrast in every neighbourhood, ridges positive."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.foreground import local_range

if TYPE_CHECKING:
    from numpy.typing import NDArray

SHRUNK_PX: Final = 4  # side of a pixel of the smaller images for means and areas


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
    """Hold a locally normalized image, (H, W)."""

    pixels: NDArray[np.float32]  # zero mean, unit deviation, ridges positive; 0 where invalid
    contrast: NDArray[np.float32]  # local standard deviation of the grey levels
    valid: NDArray[np.bool_]  # False in flat areas that touch the border of the image


def normalize(
    grey: NDArray[np.uint8], parameters: NormalizationParameters | None = None
) -> NormalizedImage:
    """Normalize brightness and contrast of an image (H, W) at 500 dpi, ridges dark.

    Flat areas that touch the border (a sensor's frame, white paper) are excluded from the local
    statistics, so that ridges beside them keep their contrast.
    """
    p = parameters or NormalizationParameters()
    flat = _flat_border(grey, p)
    skin = (~flat).astype(np.float32)
    blur = _Blur(skin, p.window_sigma_px)
    values = np.multiply(grey, skin)
    deviation = blur.mean(values)
    np.subtract(deviation, values, out=deviation)
    np.multiply(deviation, skin, out=deviation)
    contrast = blur.mean(np.multiply(deviation, deviation, out=values))
    np.sqrt(contrast, out=contrast)
    pixels = np.divide(deviation, np.maximum(contrast, p.min_contrast, out=values), out=deviation)
    return NormalizedImage(np.clip(pixels, -p.clip, p.clip, out=pixels), contrast, ~flat)


def _flat_border(grey: NDArray[np.uint8], p: NormalizationParameters) -> NDArray[np.bool_]:
    """Return the large areas without grey-level variation that touch the image's border.

    They are found on every fourth pixel of every fourth row.
    """
    box = np.ones((p.flat_window_px, p.flat_window_px), np.uint8)
    spread = local_range(grey, p.flat_window_px)
    flat = cv2.dilate((spread <= p.flat_range).view(np.uint8), box)
    few = np.ascontiguousarray(flat[::SHRUNK_PX, ::SHRUNK_PX])
    count, labels, stats, _ = cv2.connectedComponentsWithStats(few, connectivity=4)
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    outside = np.zeros(count, np.uint8)
    outside[border] = stats[border, cv2.CC_STAT_AREA] * SHRUNK_PX**2 >= p.min_flat_area_px
    outside[0] = 0
    near = cv2.dilate(outside[labels], np.ones((3, 3), np.uint8))
    near = near.repeat(SHRUNK_PX, axis=0).repeat(SHRUNK_PX, axis=1)
    near = near[: grey.shape[0], : grey.shape[1]]
    return np.asarray(cv2.bitwise_and(flat, near), bool)


class _Blur:
    """Means around each pixel, weighted by a Gaussian and by `weight`, on a smaller image."""

    def __init__(self, weight: NDArray[np.float32], sigma: float) -> None:
        height, width = weight.shape
        shrunk = max(1, min(SHRUNK_PX, int(sigma / 2)))
        self.small = (-(-width // shrunk), -(-height // shrunk))
        self.large = (self.small[0] * shrunk, self.small[1] * shrunk)
        # shrinking and interpolation blur as well: with variances of (n² - 1) / 12 and / 6
        self.sigma = math.sqrt(sigma * sigma - (shrunk**2 - 1) / 4) / shrunk
        self.share = self._blurred(weight) + np.float32(1e-6)

    def mean(self, weighed: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the means around each pixel of an image that was multiplied by the weight."""
        height, width = weighed.shape
        mean = self._blurred(weighed) / self.share
        mean = cv2.resize(mean, self.large, interpolation=cv2.INTER_LINEAR)[:height, :width]
        return np.asarray(mean, np.float32)

    def _blurred(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the image, small and blurred."""
        height, width = image.shape
        below, beside = self.large[1] - height, self.large[0] - width
        whole = cv2.copyMakeBorder(image, 0, below, 0, beside, cv2.BORDER_REFLECT)
        small = cv2.resize(whole, self.small, interpolation=cv2.INTER_AREA)
        blurred = cv2.GaussianBlur(small, (0, 0), self.sigma, borderType=cv2.BORDER_REFLECT)
        return np.asarray(blurred, np.float32)

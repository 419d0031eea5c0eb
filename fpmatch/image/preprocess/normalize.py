"""Local normalization: zero mean and unit contrast in every neighbourhood, ridges positive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import cv2
import numpy as np

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats, Grey, Mask

# Lengths in pixels at 500 dpi, contrasts in grey levels.
SHRUNK_PX: Final = 4  # side of a pixel of the smaller images for means and areas
WINDOW_SIGMA_PX: Final = 12.0
# shrinking and interpolation blur as well: with variances of (n² - 1) / 12 and / 6
_SHRUNK_SIGMA: Final = math.sqrt(WINDOW_SIGMA_PX**2 - (SHRUNK_PX**2 - 1) / 4) / SHRUNK_PX
MIN_CONTRAST: Final = 6.0
FLAT_WINDOW_PX: Final = 9
MAX_FLAT_RANGE: Final = 3
MIN_FLAT_AREA_PX: Final = 400
CLIP: Final = 3.0  # largest normalized value
SMOOTHING_SIGMA_PX: Final = 0.7  # of a grainy image, and of a large print
BACKGROUND_PX: Final = 25  # window of the background, which is no contrast of ridges
MAX_GRAIN: Final = 0.3  # mean of what smoothing takes away, of the mean contrast that it leaves
MIN_LOCAL_CONTRAST: Final = 6.0  # mean difference from the background, in grey levels, of a print
LARGE_PRINT_PX2: Final = 155_000.0  # 400 mm2: rolled prints have more, nearly all flat ones less


class NormalizedImage(NamedTuple):
    """A locally normalized image, (H, W)."""

    pixels: Floats  # zero mean, unit deviation, ridges positive; 0 where invalid
    contrast: Floats  # local standard deviation of the grey levels
    valid: Mask  # False in flat areas that touch the border of the image


def normalize(grey: Grey) -> NormalizedImage:
    """Normalize brightness and contrast of an image (H, W) at 500 dpi, ridges dark.

    A noisy image, such as one of a capacitive sensor, is smoothed first, and so is a large print,
    which has more minutiae than are needed. Flat areas that
    touch the border (a sensor's frame, white paper) are excluded from the local statistics, so that
    ridges beside them keep their contrast.
    """
    grey = _smoothed(grey)
    flat = _flat_border(grey)
    skin = (~flat).astype(np.float32)
    share = _blurred(skin) + np.float32(1e-6)
    values = np.multiply(grey, skin)
    deviation = _mean(values, share)
    np.subtract(deviation, values, out=deviation)
    np.multiply(deviation, skin, out=deviation)
    contrast = _mean(np.multiply(deviation, deviation, out=values), share)
    np.sqrt(contrast, out=contrast)
    pixels = np.divide(deviation, np.maximum(contrast, MIN_CONTRAST, out=values), out=deviation)
    return NormalizedImage(np.clip(pixels, -CLIP, CLIP, out=pixels), contrast, ~flat)


def _smoothed(grey: Grey) -> Grey:
    """Return an image as it is, or smoothed where it is grainy or the print large."""
    smooth = cv2.GaussianBlur(grey, (0, 0), SMOOTHING_SIGMA_PX)
    ridges = cv2.absdiff(smooth, cv2.blur(smooth, (BACKGROUND_PX, BACKGROUND_PX)))
    grain, contrast = cv2.mean(cv2.absdiff(grey, smooth))[0], cv2.mean(ridges)[0]
    size = [max(1, round(side / BACKGROUND_PX)) for side in reversed(ridges.shape)]
    shown = cv2.resize(ridges, size, interpolation=cv2.INTER_AREA) > MIN_LOCAL_CONTRAST
    large = float(shown.mean() * ridges.size) > LARGE_PRINT_PX2
    return np.asarray(smooth, np.uint8) if large or grain > MAX_GRAIN * max(contrast, 1) else grey


def _flat_border(grey: Grey) -> Mask:
    """Return the large areas without grey-level variation that touch the image's border."""
    box = np.ones((FLAT_WINDOW_PX, FLAT_WINDOW_PX), np.uint8)
    spread = local_range(grey, FLAT_WINDOW_PX)
    flat = cv2.dilate((spread <= MAX_FLAT_RANGE).view(np.uint8), box)
    few = np.ascontiguousarray(flat[::SHRUNK_PX, ::SHRUNK_PX])
    count, labels, stats, _ = cv2.connectedComponentsWithStats(few, connectivity=4)
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    outside = np.zeros(count, np.uint8)
    outside[border] = stats[border, cv2.CC_STAT_AREA] * SHRUNK_PX**2 >= MIN_FLAT_AREA_PX
    outside[0] = 0
    near = cv2.dilate(outside[labels], np.ones((3, 3), np.uint8))
    near = near.repeat(SHRUNK_PX, axis=0).repeat(SHRUNK_PX, axis=1)
    near = near[: grey.shape[0], : grey.shape[1]]
    return np.asarray(cv2.bitwise_and(flat, near), bool)


def _mean(weighed: Floats, share: Floats) -> Floats:
    """Return the means around each pixel of an image, by a Gaussian and by a weight.

    The image was multiplied by the weight, of which `share` is the blurred one.
    """
    height, width = weighed.shape
    size = share.shape[1] * SHRUNK_PX, share.shape[0] * SHRUNK_PX
    mean = cv2.resize(_blurred(weighed) / share, size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(mean[:height, :width], np.float32)


def _blurred(image: Floats) -> Floats:
    """Return an image blurred, at a quarter of its size."""
    below, beside = (-side % SHRUNK_PX for side in image.shape)
    whole = cv2.copyMakeBorder(image, 0, below, 0, beside, cv2.BORDER_REFLECT)
    size = whole.shape[1] // SHRUNK_PX, whole.shape[0] // SHRUNK_PX
    small = cv2.resize(whole, size, interpolation=cv2.INTER_AREA)
    blurred = cv2.GaussianBlur(small, (0, 0), _SHRUNK_SIGMA, borderType=cv2.BORDER_REFLECT)
    return np.asarray(blurred, np.float32)


def local_range(grey: Grey, window_px: int) -> Grey:
    """Return the range of the grey levels in a square window around each pixel, (H, W)."""
    window = np.ones((window_px, window_px), np.uint8)
    return np.asarray(cv2.subtract(cv2.dilate(grey, window), cv2.erode(grey, window)), np.uint8)

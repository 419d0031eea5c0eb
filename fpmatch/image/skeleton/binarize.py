"""Binarization: the decision which pixels are ridge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.skeleton import _small_parts_kernel as kernel

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats, Grey, Mask

MIN_RIDGE_AREA_PX: Final = 40
MIN_HOLE_AREA_PX: Final = 14


def binarize(enhanced: Floats, mask: Mask) -> Mask:
    """Return the positive pixels of an enhanced image in its mask, without specks or pores."""
    ridges = np.ascontiguousarray((enhanced > 0) & mask).view(np.uint8)
    flip = flip_with_kernel if kernel.COMPILED else flip_with_opencv
    flip(ridges, 1, MIN_RIDGE_AREA_PX, corners=True)
    flip(ridges, 0, MIN_HOLE_AREA_PX, corners=False)
    return ridges.view(np.bool_) & mask


def flip_with_kernel(image: Grey, colour: int, min_area: int, *, corners: bool) -> None:
    """Invert, in place, the parts of value `colour` in a 0/1 image whose area is small.

    Parts of at least `min_area` pixels stay. Pixels are connected over edges, and with `corners`
    also over corners.
    """
    height, width = image.shape
    runs = np.empty((height * ((width + 1) // 2), 5), np.int32)
    kernel.flip_small_parts(image, colour, min_area, int(corners), runs)


def flip_with_opencv(image: Grey, colour: int, min_area: int, *, corners: bool) -> None:
    """Invert as `flip_with_kernel` does: the uncompiled path, and the kernel's oracle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        (image == colour).view(np.uint8), connectivity=8 if corners else 4
    )
    small = stats[:, cv2.CC_STAT_AREA] < min_area
    small[0] = False
    image ^= small[labels].view(np.uint8)

"""Binarisation: which pixels are ridge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.image.skeleton import _small_parts_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BinarizationParameters:
    """Set the smallest structures that are kept; areas in pixels at 500 dpi."""

    min_ridge_area_px: int = 40
    min_hole_area_px: int = 14


def binarize(
    enhanced: NDArray[np.float32],
    mask: NDArray[np.bool_],
    parameters: BinarizationParameters | None = None,
) -> NDArray[np.bool_]:
    """Take the positive pixels of the enhanced image as ridge, without specks and pores.

    Parameters
    ----------
    enhanced : ndarray of float32, shape (H, W)
        Enhanced image, ridges positive.
    mask : ndarray of bool, shape (H, W)
        Segmentation mask; nothing outside is ridge.
    parameters : BinarizationParameters, optional
        Areas under which specks are dropped and holes are filled.

    Returns
    -------
    ndarray of bool, shape (H, W)
        True on ridges.

    Examples
    --------
    >>> ridge = np.full((20, 20), -1, np.float32)
    >>> ridge[:, 5:10] = 1
    >>> ridge[9:11, 7] = -1
    >>> int(binarize(ridge, np.ones((20, 20), bool)).sum())
    100
    """
    p = parameters or BinarizationParameters()
    ridges = np.ascontiguousarray((enhanced > 0) & mask).view(np.uint8)
    flip = flip_with_kernel if kernel.COMPILED else flip_with_opencv
    flip(ridges, 1, p.min_ridge_area_px, corners=True)
    flip(ridges, 0, p.min_hole_area_px, corners=False)
    return ridges.view(np.bool_) & mask


def flip_with_kernel(
    image: NDArray[np.uint8], colour: int, min_area: int, *, corners: bool
) -> None:
    """Turn over, in place, the parts of the pixels `colour` whose area is under `min_area`.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W)
        0 or 1.
    colour : int
        Of which pixels the parts are.
    min_area : int
        Smallest area that stays as it is.
    corners : bool
        Whether pixels hang together over corners, or over edges only.
    """
    height, width = image.shape
    runs = np.empty((height * ((width + 1) // 2), 5), np.int32)
    kernel.flip_small_parts(image, colour, min_area, int(corners), runs)


def flip_with_opencv(
    image: NDArray[np.uint8], colour: int, min_area: int, *, corners: bool
) -> None:
    """Do as `flip_with_kernel`: the uncompiled path, and the kernel's oracle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        (image == colour).view(np.uint8), connectivity=8 if corners else 4
    )
    small = stats[:, cv2.CC_STAT_AREA] < min_area
    small[0] = False
    image ^= small[labels].view(np.uint8)

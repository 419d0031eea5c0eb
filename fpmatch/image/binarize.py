"""Binarisation: which pixels are ridge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

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
    ridges = (enhanced > 0) & mask
    ridges &= ~_small_parts(ridges, p.min_ridge_area_px, connectivity=8)
    holes = _small_parts(~ridges, p.min_hole_area_px, connectivity=4)
    return np.asarray(ridges | (holes & mask))


def _small_parts(
    binary: NDArray[np.bool_], min_area: int, *, connectivity: int
) -> NDArray[np.bool_]:
    """Return the connected parts of `binary` whose area is under `min_area`."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        binary.astype(np.uint8), connectivity=connectivity
    )
    small = stats[:, cv2.CC_STAT_AREA] < min_area
    small[0] = False
    found: NDArray[np.bool_] = small[labels]
    return found

"""Local ridge orientation: along which way the ridges run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import cv2
import numpy as np

from fpmatch.image.preprocess.arrays import block_mean_product, blocks_to_pixels, blur_blocks

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats, Mask

FINE_SIGMA_BLOCKS: Final = 0.8
COARSE_SIGMA_BLOCKS: Final = 2.5
TRUSTED_COHERENCE: Final = 0.5  # from which the fine orientation is taken alone


class OrientationField(NamedTuple):
    """The local ridge orientation of blocks, (rows, columns)."""

    orientation: Floats  # radians in [0, π), counter-clockwise on screen from +x
    coherence: Floats  # agreement of the neighbourhood with it, 0 (none) to 1


def enhanced_orientation(enhanced: Floats, mask: Mask) -> OrientationField:
    """Measure the local ridge orientation of an enhanced image (H, W) by its gradient."""
    gx, gy = (np.asarray(cv2.Sobel(enhanced, cv2.CV_32F, 1 - k, k), np.float32) for k in (0, 1))
    xx, yy, xy = (block_mean_product(a, b) for a, b in ((gx, gx), (gy, gy), (gx, gy)))
    return smoothed_orientation(np.stack([yy - xx, 2 * xy, xx + yy], axis=2) * mask[..., None])


def smoothed_orientation(stacked: Floats) -> OrientationField:
    """Smooth (cosine, sine, weight) of the doubled angle, shape (rows, columns, 3)."""
    fine, coherence = _unit(blur_blocks(stacked, FINE_SIGMA_BLOCKS))
    coarse, _ = _unit(blur_blocks(stacked, COARSE_SIGMA_BLOCKS))
    trust = np.square(np.minimum(coherence / np.float32(TRUSTED_COHERENCE), 1))
    cosine, sine = trust * fine + (1 - trust) * coarse
    orientation = np.mod(0.5 * np.arctan2(sine, cosine), np.float32(np.pi))
    orientation[orientation >= np.float32(np.pi)] = 0.0
    return OrientationField(orientation, coherence)


def _unit(stacked: Floats) -> tuple[Floats, Floats]:
    """Return the unit vectors, (2, rows, columns), and their length relative to the weight."""
    least = np.float32(1e-9)
    cosine, sine, weight = np.ascontiguousarray(stacked.transpose(2, 0, 1))
    length = np.sqrt(cosine * cosine + sine * sine)
    unit = np.stack([cosine, sine]) / np.maximum(length, least)
    return unit, np.asarray(length / np.maximum(weight, least), np.float32)


def orientation_at_pixels(orientation: Floats, shape: tuple[int, ...]) -> Floats:
    """Interpolate an orientation field of blocks to pixels (H, W), in the double angle."""
    doubled = np.dstack([np.cos(2 * orientation), np.sin(2 * orientation)]).astype(np.float32)
    large = blocks_to_pixels(doubled, shape)
    return np.asarray(np.mod(0.5 * cv2.phase(large[..., 0], large[..., 1]), np.pi), np.float32)

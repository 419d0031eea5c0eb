"""Local ridge orientation: the direction along which the ridges run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.image.preprocess.blocks import block_mean_product, blocks_to_pixels, blur_blocks

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.enhancement.spectrum import RidgeSpectrum
    from fpmatch.image.preprocess.blocks import BlockGrid


@dataclass(frozen=True, slots=True)
class OrientationParameters:
    """Set the smoothing of the orientation field; lengths in blocks (8 px at 500 dpi)."""

    energy_power: float = 1.0
    fine_sigma_blocks: float = 0.8
    coarse_sigma_blocks: float = 2.5
    trusted_coherence: float = 0.5


@dataclass(frozen=True, slots=True)
class OrientationField:
    """Hold the local ridge orientation of blocks, (rows, columns)."""

    orientation: NDArray[np.float32]  # radians in [0, π), counter-clockwise on screen from +x
    coherence: NDArray[np.float32]  # agreement of the neighbourhood with it, 0 (none) to 1


def ridge_orientation(
    spectrum: RidgeSpectrum,
    mask: NDArray[np.bool_],
    parameters: OrientationParameters | None = None,
) -> OrientationField:
    """Estimate the local ridge orientation from the local spectrum.

    Energies are averaged in the double angle, over a narrow neighbourhood where they agree and a
    wider one where they do not. Blocks outside the mask do not influence those inside.

    References
    ----------
    Kass, Witkin, "Analyzing oriented patterns", CVGIP 37 (1987), for the double angle.
    """
    p = parameters or OrientationParameters()
    weight = (mask / (spectrum.total + 1e-3)).astype(np.float32)
    share = (spectrum.energy * weight[..., None, None]) ** p.energy_power
    by_angle = share.sum(axis=3)
    doubled = 2.0 * spectrum.angles
    stacked = np.stack(
        [by_angle @ np.cos(doubled), by_angle @ np.sin(doubled), by_angle.sum(axis=2)], axis=2
    )
    return _smoothed(stacked, p)


def enhanced_orientation(
    enhanced: NDArray[np.float32],
    mask: NDArray[np.bool_],
    grid: BlockGrid,
    parameters: OrientationParameters | None = None,
) -> OrientationField:
    """Measure the local ridge orientation of an enhanced image (H, W) by its gradient.

    Smoothing and mask are as in `ridge_orientation`.
    """
    p = parameters or OrientationParameters()
    gx = np.asarray(cv2.Sobel(enhanced, cv2.CV_32F, 1, 0), np.float32)
    gy = np.asarray(cv2.Sobel(enhanced, cv2.CV_32F, 0, 1), np.float32)
    xx, yy, xy = (block_mean_product(a, b, grid) for a, b in ((gx, gx), (gy, gy), (gx, gy)))
    stacked = np.stack([yy - xx, 2 * xy, xx + yy], axis=2) * mask[..., None]
    return _smoothed(stacked, p)


def _smoothed(stacked: NDArray[np.float32], p: OrientationParameters) -> OrientationField:
    """Smooth (cosine, sine, weight) of the doubled angle, shape (rows, columns, 3)."""
    fine, coherence = _unit(blur_blocks(stacked, p.fine_sigma_blocks))
    coarse, _ = _unit(blur_blocks(stacked, p.coarse_sigma_blocks))
    trust = np.square(np.minimum(coherence / np.float32(p.trusted_coherence), 1))
    cosine, sine = trust * fine + (1 - trust) * coarse
    orientation = np.mod(0.5 * np.arctan2(sine, cosine), np.float32(np.pi))
    orientation[orientation >= np.float32(np.pi)] = 0.0
    return OrientationField(orientation, coherence)


def orientation_at_pixels(orientation: NDArray[np.float32], grid: BlockGrid) -> NDArray[np.float32]:
    """Interpolate an orientation field of blocks to pixels, in the double angle; shape (H, W)."""
    doubled = np.dstack([np.cos(2 * orientation), np.sin(2 * orientation)]).astype(np.float32)
    large = blocks_to_pixels(doubled, grid)
    angle = np.mod(0.5 * cv2.phase(large[..., 0], large[..., 1]), np.pi)
    return np.asarray(angle, np.float32)


def _unit(stacked: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the unit vectors, (2, rows, columns), and their length relative to the weight."""
    least = np.float32(1e-9)
    cosine, sine, weight = np.ascontiguousarray(stacked.transpose(2, 0, 1))
    length = np.sqrt(cosine * cosine + sine * sine)
    unit = np.stack([cosine, sine]) / np.maximum(length, least)
    return unit, np.asarray(length / np.maximum(weight, least), np.float32)

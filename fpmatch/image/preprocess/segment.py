"""Segmentation: the area of the image that contains ridges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.image.preprocess.blocks import block_mean_product, blocks_to_pixels, blur_blocks
from fpmatch.image.preprocess.percentiles import percentiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.enhancement.spectrum import RidgeSpectrum
    from fpmatch.image.preprocess.blocks import BlockGrid
    from fpmatch.image.preprocess.normalize import NormalizedImage


@dataclass(frozen=True, slots=True)
class SegmentationParameters:
    """Set the segmentation; lengths in blocks of the spectrum (8 px at 500 dpi)."""

    smoothing_blocks: float = 1.2
    min_strength: float = 0.10
    min_certainty: float = 0.15
    min_contrast: float = 8.0
    min_relative_contrast: float = 0.25
    min_relative_contrast_of_certain: float = 0.3
    closing_blocks: int = 5
    opening_blocks: int = 5
    opening_blocks_of_certain: int = 3
    min_area_blocks: int = 40
    min_relative_area: float = 0.2


def segment(
    image: NormalizedImage,
    spectrum: RidgeSpectrum,
    parameters: SegmentationParameters | None = None,
) -> NDArray[np.bool_]:
    """Find the blocks that contain ridges, (rows, columns), on the grid of the spectrum.

    A block belongs to the print where one wave carries enough of the local energy and the local
    contrast is not small compared with that of the print; then edges are smoothed, holes filled and
    small parts dropped.
    """
    p = parameters or SegmentationParameters()
    strength = ridge_strength(spectrum, p.smoothing_blocks)
    certain = strength >= p.min_strength
    ridges = _of_contrast(image, strength, certain, spectrum, p.min_relative_contrast, p)
    return _tidy(ridges, p.opening_blocks, p)


def segment_enhanced(
    image: NormalizedImage,
    enhanced: NDArray[np.float32],
    grid: BlockGrid,
    parameters: SegmentationParameters | None = None,
) -> NDArray[np.bool_]:
    """Find the blocks, (rows, columns), whose ridges the network is certain of.

    `enhanced` (H, W) comes from `fpmatch.image.enhancement.network`: -1 to 1, about 0 where nothing
    is certain.
    """
    p = parameters or SegmentationParameters()
    certainty = blur_blocks(block_mean_product(enhanced, enhanced, grid), p.smoothing_blocks)
    certain = certainty >= p.min_certainty
    least = p.min_relative_contrast_of_certain
    ridges = _of_contrast(image, certainty, certain, grid, least, p)
    return _tidy(ridges, p.opening_blocks_of_certain, p)


def _of_contrast(
    image: NormalizedImage,
    strength: NDArray[np.float32],
    ridges: NDArray[np.bool_],
    grid: BlockGrid,
    min_relative_contrast: float,
    p: SegmentationParameters,
) -> NDArray[np.bool_]:
    """Return those of the blocks `ridges` whose contrast is similar to that of strong ones."""
    valid = image.valid.astype(np.float32)
    contrast = block_mean_product(image.contrast, valid, grid)
    ridges = ridges & (block_mean_product(valid, valid, grid) > 0.5)
    if not ridges.any():
        return ridges
    strong = ridges & (strength >= percentiles(strength[ridges], 50)[0])
    usual = float(percentiles(contrast[strong], 50)[0])
    ridges &= contrast >= max(p.min_contrast, min_relative_contrast * usual)
    return ridges


def ridge_strength(spectrum: RidgeSpectrum, smoothing_blocks: float) -> NDArray[np.float32]:
    """Return the largest share of the local energy in one wave, 0..1, shape (rows, columns)."""
    rows, columns, angles, periods = spectrum.energy.shape
    energy = blur_blocks(spectrum.energy.reshape(rows, columns, angles * periods), smoothing_blocks)
    total = blur_blocks(spectrum.total, smoothing_blocks)
    strength: NDArray[np.float32] = energy.max(axis=2) / (total + 1e-3)
    return strength


def mask_at_pixels(mask: NDArray[np.bool_], grid: BlockGrid) -> NDArray[np.bool_]:
    """Return the mask of blocks as a smooth mask of pixels, shape (H, W)."""
    pixels: NDArray[np.bool_] = blocks_to_pixels(mask.astype(np.float32), grid) > 0.5
    return pixels


def _tidy(
    ridges: NDArray[np.bool_], opening_blocks: int, p: SegmentationParameters
) -> NDArray[np.bool_]:
    """Close, open, drop small parts, fill holes."""
    margin = p.closing_blocks
    padded = np.pad(ridges, margin).astype(np.uint8)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, _disc(p.closing_blocks))
    opened = cv2.morphologyEx(closed, cv2.MORPH_OPEN, _disc(opening_blocks))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
    area = stats[:, cv2.CC_STAT_AREA].copy()
    area[0] = 0
    keep = area >= max(p.min_area_blocks, p.min_relative_area * area.max(initial=0))
    print_ = keep[labels]
    _, outside = cv2.connectedComponents((~print_).astype(np.uint8), connectivity=4)
    filled: NDArray[np.bool_] = outside != outside[0, 0]
    return filled[margin:-margin, margin:-margin]


def _disc(diameter: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter, diameter)), np.uint8)

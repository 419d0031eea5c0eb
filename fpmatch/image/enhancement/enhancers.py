"""Mask, orientation and enhanced image of a print, by one of two methods.

*Learned*: a small network enhances the ridges, from which mask and orientation are measured.
*Filters*: mask, orientation and period come from a windowed spectrum, and every pixel is filtered
along its ridge, twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.enhancement.blend import blend
from fpmatch.image.enhancement.gabor import gabor_filter
from fpmatch.image.enhancement.network import enhance_by_network
from fpmatch.image.enhancement.orientation import (
    enhanced_orientation,
    orientation_at_pixels,
    ridge_orientation,
)
from fpmatch.image.enhancement.ridge_period import ridge_period
from fpmatch.image.enhancement.spectrum import ridge_spectrum
from fpmatch.image.preprocess.blocks import Blocks, blocks_to_pixels
from fpmatch.image.preprocess.segment import mask_at_pixels, segment, segment_enhanced

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from fpmatch.image.enhancement.orientation import OrientationField
    from fpmatch.image.parameters import ExtractionParameters
    from fpmatch.image.preprocess.normalize import NormalizedImage
    from fpmatch.image.recorder import UncropRecorder

    Enhancer = Callable[[NormalizedImage, ExtractionParameters, UncropRecorder], "EnhancedPrint"]

BLOCK_PX: Final = 8  # side of the blocks of the learned method, at 500 dpi


@dataclass(frozen=True, slots=True, eq=False)
class EnhancedPrint:
    """Hold an enhanced image with its mask and orientation.

    Parameters
    ----------
    step_px : int
        Side of the blocks.
    blocks, mask : ndarray of bool, shape (rows, columns) and (H, W)
        Segmentation mask on the blocks, and at the pixels.
    field : OrientationField
        Ridge orientation of the blocks.
    enhanced : ndarray of float32, shape (H, W)
        Enhanced image, ridges positive, 0 outside the mask.
    """

    step_px: int
    blocks: NDArray[np.bool_]
    mask: NDArray[np.bool_]
    field: OrientationField
    enhanced: NDArray[np.float32]


def enhance_learned(
    image: NormalizedImage, p: ExtractionParameters, stages: UncropRecorder
) -> EnhancedPrint:
    """Enhance the ridges by the network, and measure mask and orientation on them."""
    grid = Blocks(BLOCK_PX, (image.pixels.shape[0], image.pixels.shape[1]))
    ridges = enhance_by_network(image.pixels)
    blocks = segment_enhanced(image, ridges, grid, p.segmentation)
    mask = mask_at_pixels(blocks, grid)
    field = enhanced_orientation(ridges, blocks, grid, p.orientation)
    enhanced = np.asarray(cv2.copyTo(ridges, mask.view(np.uint8)), np.float32)
    stages.record("enhanced", enhanced)
    stages.record("mask", mask)
    if stages.wants("orientation") or stages.wants("coherence"):
        orientation = orientation_at_pixels(field.orientation, grid)
        stages.record("orientation", np.where(mask, orientation, np.nan))
        stages.record("coherence", blocks_to_pixels(field.coherence, grid))
    return EnhancedPrint(BLOCK_PX, blocks, mask, field, enhanced)


def enhance_gabor(
    image: NormalizedImage, p: ExtractionParameters, stages: UncropRecorder
) -> EnhancedPrint:
    """Measure orientation and period in the local spectrum, and filter the image along them.

    Both are measured once more on a blend of the image and its enhancement.
    """
    spectrum = ridge_spectrum(image.pixels, p.spectrum)
    blocks = segment(image, spectrum, p.segmentation)
    mask = mask_at_pixels(blocks, spectrum)
    stages.record("mask", mask)
    pixels = image.pixels
    for last in (*[False] * p.blend.rounds, True):
        field = ridge_orientation(spectrum, blocks, p.orientation)
        orientation = orientation_at_pixels(field.orientation, spectrum)
        period = blocks_to_pixels(ridge_period(spectrum, field, blocks, p.period), spectrum)
        enhanced = gabor_filter(pixels, mask, orientation, period, p.enhancement)
        if not last:
            spectrum = ridge_spectrum(blend(pixels, enhanced, mask, p.blend), p.spectrum)
    stages.record("orientation", np.where(mask, orientation, np.nan))
    stages.record("coherence", blocks_to_pixels(field.coherence, spectrum))
    stages.record("period", np.where(mask, period, np.nan))
    stages.record("enhanced", enhanced)
    return EnhancedPrint(spectrum.step_px, blocks, mask, field, enhanced)


ENHANCERS: Final[Mapping[str, Enhancer]] = {"learned": enhance_learned, "filters": enhance_gabor}
"""The methods by name."""

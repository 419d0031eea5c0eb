"""Mask, orientation and enhanced image of a print, by one of two methods.

*Learned*: a small network enhances the ridges, from which mask and orientation are measured.
*Filters*: mask, orientation and period come from a windowed spectrum, and every pixel is filtered
along its ridge, twice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import cv2
import numpy as np

from fpmatch.image.enhancement.network import enhance_by_network
from fpmatch.image.enhancement.orientation import (
    enhanced_orientation,
    orientation_at_pixels,
    ridge_orientation,
)
from fpmatch.image.preprocess.blocks import blocks_to_pixels
from fpmatch.image.preprocess.segment import mask_at_pixels, segment, segment_enhanced

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fpmatch.image.enhancement.orientation import OrientationField
    from fpmatch.image.preprocess.arrays import Floats, Mask, UncropRecorder
    from fpmatch.image.preprocess.normalize import NormalizedImage

    Enhancer = Callable[[NormalizedImage, UncropRecorder], "EnhancedPrint"]

# Of the blend, on which orientation and period are measured again.
ENHANCED_SHARE: Final = 0.5
BLEND_SIGMA_PX: Final = 12.0  # window in which the enhanced image is scaled to unit amplitude
MIN_AMPLITUDE: Final = 0.05  # added to the local one, so that noise is not amplified
MAX_AMPLITUDE: Final = 2.0  # of the scaled image


class EnhancedPrint(NamedTuple):
    """An enhanced image with its mask and orientation."""

    blocks: Mask  # segmentation mask on the blocks, (rows, columns)
    mask: Mask  # the same at the pixels, (H, W)
    field: OrientationField  # ridge orientation of the blocks
    enhanced: Floats  # ridges positive, 0 outside the mask, (H, W)


def enhance_learned(image: NormalizedImage, stages: UncropRecorder) -> EnhancedPrint:
    """Enhance the ridges by the network, and measure mask and orientation on them."""
    shape = image.pixels.shape
    ridges = enhance_by_network(image.pixels)
    blocks = segment_enhanced(image, ridges)
    mask = mask_at_pixels(blocks, shape)
    field = enhanced_orientation(ridges, blocks)
    enhanced = np.asarray(cv2.copyTo(ridges, mask.view(np.uint8)), np.float32)
    stages.record("enhanced", enhanced)
    stages.record("mask", mask)
    if stages.wants("orientation") or stages.wants("coherence"):
        orientation = orientation_at_pixels(field.orientation, shape)
        stages.record("orientation", np.where(mask, orientation, np.nan))
        stages.record("coherence", blocks_to_pixels(field.coherence, shape))
    return EnhancedPrint(blocks, mask, field, enhanced)


def enhance_gabor(image: NormalizedImage, stages: UncropRecorder) -> EnhancedPrint:
    """Filter the image along its ridges, whose course is measured on it and then on a blend."""
    # the filters are one method of two: their modules load where it is chosen
    from fpmatch.image.enhancement.gabor import gabor_filter  # noqa: PLC0415
    from fpmatch.image.enhancement.orientation import ridge_period  # noqa: PLC0415
    from fpmatch.image.preprocess.spectrum import ridge_spectrum  # noqa: PLC0415

    pixels, shape = image.pixels, image.pixels.shape
    spectrum = ridge_spectrum(pixels)
    blocks = segment(image, spectrum)
    mask = mask_at_pixels(blocks, shape)
    stages.record("mask", mask)
    for last in (False, True):
        field = ridge_orientation(spectrum, blocks)
        orientation = orientation_at_pixels(field.orientation, shape)
        period = blocks_to_pixels(ridge_period(spectrum, field, blocks), shape)
        enhanced = gabor_filter(pixels, mask, orientation, period)
        if not last:
            spectrum = ridge_spectrum(blend(pixels, enhanced, mask))
    stages.record("orientation", np.where(mask, orientation, np.nan))
    stages.record("coherence", blocks_to_pixels(field.coherence, shape))
    stages.record("period", np.where(mask, period, np.nan))
    stages.record("enhanced", enhanced)
    return EnhancedPrint(blocks, mask, field, enhanced)


def blend(pixels: Floats, enhanced: Floats, mask: Mask) -> Floats:
    """Blend a normalized image (H, W) with its enhancement, scaled to the same local amplitude.

    In gaps by scars, dry or faint skin, the enhanced image continues the ridges around, so that the
    orientation of the blend follows them. The blend is 0 outside the mask.
    """
    power = cv2.GaussianBlur(enhanced * enhanced, (0, 0), BLEND_SIGMA_PX)
    scaled = np.clip(enhanced / (np.sqrt(power) + MIN_AMPLITUDE), -MAX_AMPLITUDE, MAX_AMPLITUDE)
    mixed = (1 - ENHANCED_SHARE) * pixels + ENHANCED_SHARE * scaled
    return np.asarray(mixed * mask, np.float32)


ENHANCERS: Final[Mapping[str, Enhancer]] = {"learned": enhance_learned, "filters": enhance_gabor}
"""The methods by name."""

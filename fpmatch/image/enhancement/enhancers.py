"""Mask, orientation and enhanced image of a print, by one of two methods.

*Learned*: a small network enhances the ridges, from which mask and orientation are measured.
*Filters*: mask, orientation and period come from a windowed spectrum, and every pixel is filtered
along its ridge, twice.

The network: Ronneberger, Fischer, Brox, "U-Net: convolutional networks for biomedical image
segmentation", MICCAI 2015. ``python -m research train enhancer`` trains it on synthetic prints and
their ideal ridges; OpenCV runs it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import cv2
import numpy as np

from fpmatch.base.network import Network
from fpmatch.image.preprocess.arrays import (
    OrientationField,
    block_mean_product,
    blocks_to_pixels,
)
from fpmatch.image.preprocess.foreground import segment, segment_enhanced

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fpmatch.image.preprocess.arrays import Floats, Mask
    from fpmatch.image.preprocess.normalize import NormalizedImage

    Enhancer = Callable[[NormalizedImage], "EnhancedPrint"]

MAPS: Final = {"orientation": np.nan, "coherence": 0.0, "period": np.nan}
"""Stages that serve for display, with their value outside the print."""

# Of the smoothing of orientations.
FINE_SIGMA_BLOCKS: Final = 0.8
COARSE_SIGMA_BLOCKS: Final = 2.5
TRUSTED_COHERENCE: Final = 0.5  # from which the fine orientation is taken alone

# Of the blend, on which orientation and period are measured again.
ENHANCED_SHARE: Final = 0.5
BLEND_SIGMA_PX: Final = 12.0  # window in which the enhanced image is scaled to unit amplitude
MIN_AMPLITUDE: Final = 0.05  # added to the local one, so that noise is not amplified
MAX_AMPLITUDE: Final = 2.0  # of the scaled image
NETWORK_FILE: Final = Path(__file__).with_name("network.onnx")
NETWORK_SHA256: Final = "afb55ed31ea9b51a12ab0044e125623efeb70d38db7bb28c6d17f9794ce48f1a"
PATCH_PX: Final = 4  # side of a patch, one position of the network
SIDE_STEP_PX: Final = 16  # the sides of its input are multiples of this
_NETWORK: Final = Network(NETWORK_FILE, NETWORK_SHA256)


def enhanced_orientation(enhanced: Floats, mask: Mask) -> OrientationField:
    """Measure the local ridge orientation of an enhanced image (H, W) by its gradient."""
    gx, gy = (np.asarray(cv2.Sobel(enhanced, cv2.CV_32F, 1 - k, k), np.float32) for k in (0, 1))
    xx, yy, xy = (block_mean_product(a, b) for a, b in ((gx, gx), (gy, gy), (gx, gy)))
    return smoothed_orientation(np.stack([yy - xx, 2 * xy, xx + yy], axis=2) * mask[..., None])


def smoothed_orientation(stacked: Floats) -> OrientationField:
    """Smooth (cosine, sine, weight) of the doubled angle, shape (rows, columns, 3).

    The average is taken over a narrow neighbourhood where the orientations in it agree, and a wider
    one where they do not (Kass, Witkin, "Analyzing oriented patterns", CVGIP 37, 1987).
    """
    units, lengths, least = [], [], np.float32(1e-9)
    for sigma in (FINE_SIGMA_BLOCKS, COARSE_SIGMA_BLOCKS):
        blurred = cv2.GaussianBlur(stacked, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
        cosine, sine, weight = np.ascontiguousarray(blurred.transpose(2, 0, 1))
        length = np.sqrt(cosine * cosine + sine * sine)
        units.append(np.stack([cosine, sine]) / np.maximum(length, least))
        lengths.append(length / np.maximum(weight, least))
    (fine, coarse), coherence = units, np.asarray(lengths[0], np.float32)
    trust = np.square(np.minimum(coherence / np.float32(TRUSTED_COHERENCE), 1))
    cosine, sine = trust * fine + (1 - trust) * coarse
    orientation = np.mod(0.5 * np.arctan2(sine, cosine), np.float32(np.pi))
    orientation[orientation >= np.float32(np.pi)] = 0.0
    return OrientationField(orientation, coherence)


def orientation_at_pixels(orientation: Floats, shape: tuple[int, ...]) -> Floats:
    """Interpolate an orientation field of blocks to pixels (H, W), in the double angle."""
    doubled = np.dstack([np.cos(2 * orientation), np.sin(2 * orientation)]).astype(np.float32)
    large = blocks_to_pixels(doubled, shape)
    return np.asarray(np.mod(0.5 * cv2.phase(large[..., 0], large[..., 1]), np.pi), np.float32)


class EnhancedPrint(NamedTuple):
    """An enhanced image with its mask and orientation."""

    blocks: Mask  # segmentation mask on the blocks, (rows, columns)
    mask: Mask  # the same at the pixels, (H, W)
    field: OrientationField  # ridge orientation of the blocks
    enhanced: Floats  # ridges positive, 0 outside the mask, (H, W)
    period: Floats | None = None  # of the ridges at the pixels, where it was measured, (H, W)

    def maps(self) -> dict[str, Floats]:
        """Return the maps of `MAPS` at the pixels that were measured, (H, W)."""
        shape = self.mask.shape
        orientation = orientation_at_pixels(self.field.orientation, shape)
        maps = {"orientation": np.where(self.mask, orientation, np.nan)}
        maps["coherence"] = blocks_to_pixels(self.field.coherence, shape)
        if self.period is not None:
            maps["period"] = np.where(self.mask, self.period, np.nan)
        return maps


def enhance_learned(image: NormalizedImage) -> EnhancedPrint:
    """Enhance the ridges by the network, and measure mask and orientation on them."""
    shape = image.pixels.shape
    ridges = enhance_by_network(image.pixels)
    blocks = segment_enhanced(image, ridges)
    mask = blocks_to_pixels(blocks.astype(np.float32), shape) > 0.5
    field = enhanced_orientation(ridges, blocks)
    enhanced = np.asarray(cv2.copyTo(ridges, mask.view(np.uint8)), np.float32)
    return EnhancedPrint(blocks, mask, field, enhanced)


def enhance_gabor(image: NormalizedImage) -> EnhancedPrint:
    """Filter the image along its ridges, whose course is measured on it and then on a blend."""
    # the filters are one method of two: their modules load where it is chosen
    from fpmatch.image.enhancement.gabor import (  # noqa: PLC0415
        doubled_angles,
        gabor_filter,
        ridge_period,
    )
    from fpmatch.image.preprocess.spectrum import ridge_spectrum  # noqa: PLC0415

    pixels, shape = image.pixels, image.pixels.shape
    spectrum = ridge_spectrum(pixels)
    blocks = segment(image, spectrum)
    mask = blocks_to_pixels(blocks.astype(np.float32), shape) > 0.5
    for last in (False, True):
        field = smoothed_orientation(doubled_angles(spectrum, blocks))
        orientation = orientation_at_pixels(field.orientation, shape)
        period = blocks_to_pixels(ridge_period(spectrum, field, blocks), shape)
        enhanced = gabor_filter(pixels, mask, orientation, period)
        if not last:
            spectrum = ridge_spectrum(blend(pixels, enhanced, mask))
    return EnhancedPrint(blocks, mask, field, enhanced, period)


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


def enhance_by_network(pixels: Floats) -> Floats:
    """Enhance the ridges of a normalized image (H, W) at 500 dpi, ridges positive.

    Returns twice the probability of a ridge less one: 1 for a ridge, -1 for a valley, about 0 where
    there is no print or nothing is certain. The network has one channel, of H/4 by W/4, for each
    position in a patch of 4 by 4 pixels. Raises FpmatchError if the file of the network is missing,
    damaged or of another version, or OpenCV cannot use it.
    """
    height, width = pixels.shape
    rows, columns = (-(-side // SIDE_STEP_PX) * SIDE_STEP_PX for side in (height, width))
    padded = np.zeros((rows, columns), np.float32)
    padded[:height, :width] = pixels
    rows, columns = rows // PATCH_PX, columns // PATCH_PX
    patches = padded.reshape(rows, PATCH_PX, columns, PATCH_PX).transpose(1, 3, 0, 2)
    channels = _NETWORK(np.ascontiguousarray(patches.reshape(1, PATCH_PX**2, rows, columns)))
    patches = channels.reshape(PATCH_PX, PATCH_PX, rows, columns).transpose(2, 0, 3, 1)
    logits = np.ascontiguousarray(patches.reshape(PATCH_PX * rows, PATCH_PX * columns))
    return np.ascontiguousarray(np.tanh(0.5 * logits[:height, :width]), np.float32)

"""Foreground: the box of the image in which anything varies, and the mask of the print in it.

Later stages work on that box alone. It may contain much besides the print, but all of the print.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.arrays import (
    BLOCK_PX,
    Box,
    block_mean_product,
    percentiles,
)
from fpmatch.image.preprocess.normalize import local_range

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats, Grey, Mask
    from fpmatch.image.preprocess.normalize import NormalizedImage
    from fpmatch.image.preprocess.spectrum import RidgeSpectrum

# Lengths in pixels at 500 dpi, ranges in grey levels.
ALIGNMENT_PX: Final = 2 * BLOCK_PX  # of the box's first row and column: a cell of a ridge field
WINDOW_PX: Final = 9  # in which the range is taken
_CENTRES: Final = (slice(BLOCK_PX // 2, None, BLOCK_PX),) * 2  # of the blocks
MIN_RANGE: Final = 12
MIN_RELATIVE_RANGE: Final = 0.15  # of the strong range, which is this percentile:
STRONG_PERCENTILE: Final = 95.0
BOX_OPENING_BLOCKS: Final = 3
MARGIN_PX: Final = 16
MIN_SIDE_PX: Final = 64

CONTRAST_SIDE: Final = 7  # of the square that shows the contrast of a print, in every second block
FAINT_CONTRAST: Final = 38  # grey levels; every print of nine sensors and of ink has more
LEAST_CONTRAST: Final = 4  # of a print; less may be rounding
STRETCHED_CONTRAST: Final = 120  # of a faint print after stretching
LEAST_INSIDE: Final = 0.5  # of the contrast, inside a block of a JPEG, its slope apart,
LEAST_DETAILED: Final = 0.1  # in so many of the blocks of a square
GROUND_PX, GROUND_SIGMA_PX = 61, 12.0  # window of the median that is its ground, and smoothing

# Lengths in blocks (8 px at 500 dpi), contrasts in grey levels.
SMOOTHING_BLOCKS: Final = 1.2
MIN_STRENGTH: Final = 0.10  # share of the local energy in one wave
MIN_CERTAINTY: Final = 0.15  # mean square of the network's output
MIN_CONTRAST: Final = 8.0
MIN_RELATIVE_CONTRAST: Final = 0.25  # of the usual contrast of strong ridges
MIN_RELATIVE_CONTRAST_OF_CERTAIN: Final = 0.3
CLOSING_BLOCKS: Final = 5
OPENING_BLOCKS: Final = 5
OPENING_BLOCKS_OF_CERTAIN: Final = 3
MIN_AREA_BLOCKS: Final = 40
MIN_RELATIVE_AREA: Final = 0.2  # of the largest part


_SLOPE: Final = np.arange(BLOCK_PX, dtype=np.float32) - (BLOCK_PX - 1) / 2
_PLANE: Final = np.linalg.qr(
    np.stack([np.ones(BLOCK_PX**2), np.repeat(_SLOPE, BLOCK_PX), np.tile(_SLOPE, BLOCK_PX)], axis=1)
)[0].astype(np.float32)
"""Planes over a block, orthonormal, (pixels, 3)."""


def ridge_contrast(grey: Grey) -> int:
    """Return the contrast of the print in an image (H, W) at 500 dpi, in grey levels.

    It is the median range of the blocks in the square, of 6 mm, in which it is highest. A line of
    text, a frame or the border of a blot fills no such square, however strong it is.
    """
    blocks = local_range(grey, WINDOW_PX)[_CENTRES]
    if not blocks.size:
        return 0
    padded = np.pad(blocks[::2, ::2], CONTRAST_SIDE // 2)
    return int(cv2.medianBlur(padded, CONTRAST_SIDE).max())


def _has_detail(grey: Grey, contrast: float, step: int) -> bool:
    """Return whether blocks of 8 by 8 pixels, each `step`-th, vary by a share of the contrast.

    Their slopes do not count: a gradient that was saved as JPEG has steps between its blocks, and
    little but a slope in them.
    """
    rows, columns = (side // BLOCK_PX for side in grey.shape)
    whole = grey[: rows * BLOCK_PX, : columns * BLOCK_PX].astype(np.float32)
    blocks = whole.reshape(rows, BLOCK_PX, columns, BLOCK_PX).transpose(0, 2, 1, 3)[::step, ::step]
    pixels = blocks.reshape(*blocks.shape[:2], BLOCK_PX**2)
    varied = np.ptp(pixels - pixels @ _PLANE @ _PLANE.T, axis=2) >= LEAST_INSIDE * contrast
    share = cv2.blur(np.pad(varied, CONTRAST_SIDE // 2).astype(np.float32), 2 * (CONTRAST_SIDE,))
    return float(share.max()) >= LEAST_DETAILED


def stretch_contrast(grey: Grey, source: Grey | None = None) -> Grey:
    """Return an image (H, W) at 500 dpi as it is, or stretched where its print is faint.

    The differences from the ground, a mean without text and blots, are stretched alike everywhere,
    so that the limits of later stages, which are in grey levels, suit the print. An image whose
    contrast is that of its ground, such as a gradient, or of the borders of a JPEG's blocks, stays
    as it is; the blocks are those of the image before it was resampled, `source`.
    """
    contrast = ridge_contrast(grey)
    if not LEAST_CONTRAST <= contrast < FAINT_CONTRAST:
        return grey
    blocks = grey if source is None else source
    zoom = blocks.shape[0] / grey.shape[0]
    if not _has_detail(blocks, contrast / max(1.0, zoom), max(1, round(2 * zoom))):
        return grey
    middle = cv2.medianBlur(grey, GROUND_PX).astype(np.float32)
    near = np.clip(grey, middle - contrast, middle + contrast)
    ground = cv2.GaussianBlur(near, (0, 0), GROUND_SIGMA_PX)
    levels = np.clip(128 + STRETCHED_CONTRAST / contrast * (grey - ground), 0, 255)
    return np.asarray(np.rint(levels), np.uint8)


def foreground_box(grey: Grey) -> Box:
    """Find the box of all that varies in grey level, in an image (H, W) at 500 dpi.

    Its sides are multiples of `ALIGNMENT_PX`, or those of the image; it is the whole image where
    nothing stands out.
    """
    height, width = grey.shape
    blocks = local_range(grey, WINDOW_PX)[_CENTRES]
    if not blocks.size:
        return Box(0, height, 0, width)
    strong = float(percentiles(blocks.ravel().astype(np.float32), STRONG_PERCENTILE)[0])
    lively = (blocks > max(MIN_RANGE, MIN_RELATIVE_RANGE * strong)).astype(np.uint8)
    element = np.ones((BOX_OPENING_BLOCKS, BOX_OPENING_BLOCKS), np.uint8)
    opened = np.asarray(cv2.morphologyEx(lively, cv2.MORPH_OPEN, element), bool)
    sides = []
    for axis, size in enumerate(grey.shape):
        where = np.flatnonzero(opened.any(axis=1 - axis))
        if not len(where):
            return Box(0, height, 0, width)
        first = int(where[0]) * BLOCK_PX - MARGIN_PX
        last = (int(where[-1]) + 1) * BLOCK_PX + MARGIN_PX
        lacking = max(0, MIN_SIDE_PX - (last - first))
        first = max(0, first - lacking) // ALIGNMENT_PX * ALIGNMENT_PX
        last = -(-(last + lacking) // ALIGNMENT_PX) * ALIGNMENT_PX
        sides += [first, min(last, size)]
    return Box(*sides)


def segment(image: NormalizedImage, spectrum: RidgeSpectrum) -> Mask:
    """Find the blocks, (rows, columns), in which one wave carries enough of the local energy."""
    energy = _smoothed(spectrum.energy.reshape(*spectrum.total.shape, -1)).max(axis=2)
    strength = energy / (_smoothed(spectrum.total) + np.float32(1e-3))
    return _parts_of_print(
        image, strength, strength >= MIN_STRENGTH, MIN_RELATIVE_CONTRAST, OPENING_BLOCKS
    )


def segment_enhanced(image: NormalizedImage, enhanced: Floats) -> Mask:
    """Find the blocks, (rows, columns), whose ridges the network is certain of, not near 0."""
    certainty = _smoothed(block_mean_product(enhanced, enhanced))
    return _parts_of_print(
        image,
        certainty,
        certainty >= MIN_CERTAINTY,
        MIN_RELATIVE_CONTRAST_OF_CERTAIN,
        OPENING_BLOCKS_OF_CERTAIN,
    )


def _smoothed(blocks: Floats) -> Floats:
    blurred = cv2.GaussianBlur(blocks, (0, 0), SMOOTHING_BLOCKS, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(blurred, np.float32)


def _parts_of_print(
    image: NormalizedImage, strength: Floats, ridges: Mask, min_contrast: float, opening: int
) -> Mask:
    """Return those of the blocks `ridges` that are a print, without holes and small parts.

    Their contrast is at least a share of that of strong ones, `min_contrast`. Edges are smoothed,
    by an opening of so many blocks.
    """
    valid = image.valid.astype(np.float32)
    contrast = block_mean_product(image.contrast, valid)
    ridges = ridges & (block_mean_product(valid, valid) > 0.5)
    if not ridges.any():
        return ridges
    strong = ridges & (strength >= percentiles(strength[ridges], 50)[0])
    usual = float(percentiles(contrast[strong], 50)[0])
    ridges &= contrast >= max(MIN_CONTRAST, min_contrast * usual)
    margin = CLOSING_BLOCKS
    smoothed = np.pad(ridges, margin).astype(np.uint8)
    for operation, side in ((cv2.MORPH_CLOSE, CLOSING_BLOCKS), (cv2.MORPH_OPEN, opening)):
        element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
        smoothed = np.asarray(cv2.morphologyEx(smoothed, operation, element), np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(smoothed, connectivity=4)
    area = stats[:, cv2.CC_STAT_AREA].copy()
    area[0] = 0
    keep = area >= max(MIN_AREA_BLOCKS, MIN_RELATIVE_AREA * area.max(initial=0))
    _, outside = cv2.connectedComponents((~keep[labels]).astype(np.uint8), connectivity=4)
    return np.asarray(outside != outside[0, 0])[margin:-margin, margin:-margin]

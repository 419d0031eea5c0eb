"""Foreground: the box of the image in which anything varies in grey level.

Later stages work on that box alone. It may contain much besides the print, but all of the print.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import cv2
import numpy as np

from fpmatch.image.preprocess.arrays import percentiles
from fpmatch.image.preprocess.blocks import BLOCK_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Grey, Mask

# Lengths in pixels at 500 dpi, ranges in grey levels.
ALIGNMENT_PX: Final = 2 * BLOCK_PX  # of the box's first row and column: a cell of a ridge field
WINDOW_PX: Final = 9  # in which the range is taken
MIN_RANGE: Final = 12
MIN_RELATIVE_RANGE: Final = 0.15  # of the strong range, which is this percentile:
STRONG_PERCENTILE: Final = 95.0
OPENING_BLOCKS: Final = 3
MARGIN_PX: Final = 16
MIN_SIDE_PX: Final = 64


class Box(NamedTuple):
    """A box of an image: rows `top` to before `bottom`, columns `left` to before `right`."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """The slices that cut the box out of an array (H, W)."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def uncrop(
        self, array: NDArray[Any], shape: tuple[int, int], step_px: int = 1, around: float = 0
    ) -> NDArray[Any]:
        """Pad an array (h, w) of the box to the whole image (H, W), with the value `around`.

        Each value is that of a square of `step_px` pixels a side, which divides `top` and `left`.
        """
        whole = np.full([-(-side // step_px) for side in shape], around, array.dtype)
        top, left = self.top // step_px, self.left // step_px
        whole[top : top + array.shape[0], left : left + array.shape[1]] = array
        return whole


def foreground_box(grey: Grey) -> Box:
    """Find the box of all that varies in grey level, in an image (H, W) at 500 dpi.

    Its sides are multiples of `ALIGNMENT_PX`, or those of the image; it is the whole image where
    nothing stands out.
    """
    height, width = grey.shape
    blocks = local_range(grey, WINDOW_PX)[BLOCK_PX // 2 :: BLOCK_PX, BLOCK_PX // 2 :: BLOCK_PX]
    if not blocks.size:
        return Box(0, height, 0, width)
    strong = float(percentiles(blocks.ravel().astype(np.float32), STRONG_PERCENTILE)[0])
    lively = (blocks > max(MIN_RANGE, MIN_RELATIVE_RANGE * strong)).astype(np.uint8)
    element = np.ones((OPENING_BLOCKS, OPENING_BLOCKS), np.uint8)
    opened = np.asarray(cv2.morphologyEx(lively, cv2.MORPH_OPEN, element), bool)
    rows, columns = np.atleast_1d(opened.any(axis=1), opened.any(axis=0))
    return Box(*_side(rows, height), *_side(columns, width))


def local_range(grey: Grey, window_px: int) -> Grey:
    """Return the range of the grey levels in a square window around each pixel, (H, W)."""
    window = np.ones((window_px, window_px), np.uint8)
    return np.asarray(cv2.subtract(cv2.dilate(grey, window), cv2.erode(grey, window)), np.uint8)


def _side(lively: Mask, size: int) -> tuple[int, int]:
    """Return where the box begins and ends along a side of the image of `size` pixels."""
    where = np.flatnonzero(lively)
    if not len(where):
        return 0, size
    first = int(where[0]) * BLOCK_PX - MARGIN_PX
    last = (int(where[-1]) + 1) * BLOCK_PX + MARGIN_PX
    lacking = max(0, MIN_SIDE_PX - (last - first))
    first = max(0, first - lacking) // ALIGNMENT_PX * ALIGNMENT_PX
    last = -(-(last + lacking) // ALIGNMENT_PX) * ALIGNMENT_PX
    return first, min(last, size)

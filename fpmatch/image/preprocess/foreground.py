"""Foreground: the box of an image that contains whatever varies in grey level.

Later stages work on that box alone. It may contain much besides the print, but all of the print.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.image.preprocess.percentiles import percentiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

ALIGNMENT_PX: Final = 16  # of the box's first row and column: the blocks of a template's field


@dataclass(frozen=True, slots=True)
class ForegroundParameters:
    """Set how the foreground is found; lengths in pixels at 500 dpi, ranges in grey levels."""

    window_px: int = 9
    block_px: int = 8
    strong_percentile: float = 95.0
    min_relative_range: float = 0.15
    min_range: int = 12
    opening_blocks: int = 3
    margin_px: int = 16
    min_side_px: int = 64


@dataclass(frozen=True, slots=True)
class Box:
    """Hold a box of an image: rows `top` to before `bottom`, columns `left` to before `right`."""

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


def foreground_box(grey: NDArray[np.uint8], parameters: ForegroundParameters | None = None) -> Box:
    """Find the box of all that varies in grey level, in an image at 500 dpi.

    Its sides are multiples of `ALIGNMENT_PX`, or those of the image; it is the whole image where
    nothing stands out.
    """
    p = parameters or ForegroundParameters()
    height, width = grey.shape
    spread = local_range(grey, p.window_px)
    blocks = spread[p.block_px // 2 :: p.block_px, p.block_px // 2 :: p.block_px]
    if not blocks.size:
        return Box(0, height, 0, width)
    strong = float(percentiles(blocks.ravel().astype(np.float32), p.strong_percentile)[0])
    lively = (blocks > max(p.min_range, p.min_relative_range * strong)).astype(np.uint8)
    element = np.ones((p.opening_blocks, p.opening_blocks), np.uint8)
    opened = np.asarray(cv2.morphologyEx(lively, cv2.MORPH_OPEN, element), bool)
    rows, columns = np.atleast_1d(opened.any(axis=1), opened.any(axis=0))
    return Box(*_side(rows, height, p), *_side(columns, width, p))


def local_range(grey: NDArray[np.uint8], window_px: int) -> NDArray[np.uint8]:
    """Return the range of the grey levels in a square window around each pixel, (H, W)."""
    window = np.ones((window_px, window_px), np.uint8)
    return np.asarray(cv2.subtract(cv2.dilate(grey, window), cv2.erode(grey, window)), np.uint8)


def _side(lively: NDArray[np.bool_], size: int, p: ForegroundParameters) -> tuple[int, int]:
    """Return where the box begins and ends along a side of the image of `size` pixels."""
    where = np.flatnonzero(lively)
    if not len(where):
        return 0, size
    first = int(where[0]) * p.block_px - p.margin_px
    last = (int(where[-1]) + 1) * p.block_px + p.margin_px
    lacking = max(0, p.min_side_px - (last - first))
    first = max(0, first - lacking) // ALIGNMENT_PX * ALIGNMENT_PX
    last = -(-(last + lacking) // ALIGNMENT_PX) * ALIGNMENT_PX
    return first, min(last, size)

"""Arrays of the stages: names of their types, percentiles, a recorder, and means of blocks."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Grey = NDArray[np.uint8]
    Floats = NDArray[np.float32]
    Doubles = NDArray[np.float64]
    Ints = NDArray[np.int32]
    Mask = NDArray[np.bool_]
BLOCK_PX: Final = 8  # side of a block, at 500 dpi


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
        self, array: NDArray[Any], shape: tuple[int, ...], step_px: int = 1, around: float = 0
    ) -> NDArray[Any]:
        """Pad an array (h, w) of the box to the whole image (H, W), with the value `around`.

        Each value is that of a square of `step_px` pixels a side, which divides `top` and `left`.
        """
        whole = np.full([-(-side // step_px) for side in shape], around, array.dtype)
        top, left = self.top // step_px, self.left // step_px
        whole[top : top + array.shape[0], left : left + array.shape[1]] = array
        return whole


class OrientationField(NamedTuple):
    """The local ridge orientation of blocks, (rows, columns)."""

    orientation: Floats  # radians in [0, π), counter-clockwise on screen from +x
    coherence: Floats  # agreement of the neighbourhood with it, 0 (none) to 1


def percentiles(values: NDArray[np.floating[Any]], *percents: float) -> Doubles:
    """Return percentiles of finite values (..., N) along the last axis, shape (P, ...).

    They are those of `np.percentile` by default, with linear interpolation, which imports numpy.ma
    and so costs more than one image.
    """
    last = values.shape[-1] - 1
    place = np.array(percents) * (last / 100)
    below = place.astype(np.intp)
    beyond = np.minimum(below + 1, last)
    ordered = np.partition(values, sorted({*below.tolist(), *beyond.tolist()}), axis=-1)
    low, high = (np.moveaxis(ordered[..., k], -1, 0).astype(np.float64) for k in (below, beyond))
    share = (place - below).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(low + share * (high - low))


class StageRecorder:
    """Keep the array of each stage that `extract` passes on in `stages`, a dict, in order.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import StageRecorder
    >>> recorder = StageRecorder()
    >>> recorder.record("binary", np.zeros((4, 4), bool))
    >>> list(recorder.stages)
    ['binary']
    """

    def __init__(self) -> None:
        self.stages: dict[str, NDArray[Any]] = {}

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Keep a copy of `array` under the name of its stage."""
        self.stages[stage] = array.copy()


def blocks_to_pixels(blocks: Floats, shape: tuple[int, ...]) -> Floats:
    """Interpolate blocks, (rows, columns) or (rows, columns, C), linearly to pixels, `shape`."""
    rows, columns = blocks.shape[:2]
    size = (columns * BLOCK_PX, rows * BLOCK_PX)
    large = cv2.resize(blocks, size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(large[: shape[0], : shape[1]], np.float32)


def block_mean_product(a: Floats, b: Floats) -> Floats:
    """Average the product of two images (H, W) over each block, shape (rows, columns).

    Blocks that reach beyond the image repeat its last row and column. Sums are taken row by row,
    then column by column, so that they do not depend on the machine's vector instructions.
    """
    height, width = a.shape
    rows, columns = -(-height // BLOCK_PX), -(-width // BLOCK_PX)
    product = np.empty((rows * BLOCK_PX, columns * BLOCK_PX), np.float32)
    np.multiply(a, b, out=product[:height, :width])
    product[:height, width:] = product[:height, width - 1 : width]
    product[height:] = product[height - 1]
    sums = product.reshape(rows, BLOCK_PX, -1).sum(axis=1)
    total = reduce(np.add, (sums[:, k::BLOCK_PX] for k in range(BLOCK_PX)))
    return np.asarray(total * np.float32(1 / BLOCK_PX**2), np.float32)

"""Fields on the square blocks of an image: means, blur, interpolation to pixels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Final, Protocol

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_CHANNELS: Final = 4  # that OpenCV blurs at a time


class BlockGrid(Protocol):
    """Square blocks of ``step_px`` pixels a side over an image of ``shape`` (H, W)."""

    @property
    def step_px(self) -> int:
        """Side of a block."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the image."""


@dataclass(frozen=True, slots=True)
class Blocks:
    """Cover an image of ``shape`` (H, W) by square blocks of ``step_px`` pixels a side.

    Block ``[i, j]`` is centred at pixel ``((j + 0.5)·step, (i + 0.5)·step)``; the last row and
    column may reach beyond the image.
    """

    step_px: int
    shape: tuple[int, int]


def blocks_to_pixels(blocks: NDArray[np.float32], grid: BlockGrid) -> NDArray[np.float32]:
    """Interpolate a field of blocks, (rows, columns) or (rows, columns, C), to pixels linearly."""
    height, width = grid.shape
    rows, columns = blocks.shape[:2]
    size = (columns * grid.step_px, rows * grid.step_px)
    large = cv2.resize(blocks, size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(large[:height, :width], np.float32)


def block_mean_product(
    a: NDArray[np.float32], b: NDArray[np.float32], grid: BlockGrid
) -> NDArray[np.float32]:
    """Average the product of two images (H, W) over each block, shape (rows, columns).

    Blocks that reach beyond the image repeat its last row and column. Sums are taken row by row,
    then column by column, so that they do not depend on the machine's vector instructions.
    """
    step, (height, width) = grid.step_px, grid.shape
    rows, columns = -(-height // step), -(-width // step)
    product = np.empty((rows * step, columns * step), np.float32)
    np.multiply(a, b, out=product[:height, :width])
    product[:height, width:] = product[:height, width - 1 : width]
    product[height:] = product[height - 1]
    sums = product.reshape(rows, step, -1).sum(axis=1)
    total = reduce(np.add, (sums[:, k::step] for k in range(step)))
    return np.asarray(total * np.float32(1 / step**2), np.float32)


def blur_blocks(blocks: NDArray[np.float32], sigma_blocks: float) -> NDArray[np.float32]:
    """Blur a field of blocks, shape (rows, columns) or (rows, columns, C), channel by channel."""
    planes = np.atleast_3d(np.asarray(blocks, np.float32))
    blurred = np.empty_like(planes)
    for start in range(0, planes.shape[2], _CHANNELS):
        part = np.ascontiguousarray(planes[:, :, start : start + _CHANNELS])
        blurred[:, :, start : start + _CHANNELS] = cv2.GaussianBlur(
            part, (0, 0), sigma_blocks, borderType=cv2.BORDER_REPLICATE
        ).reshape(part.shape)
    return blurred.reshape(blocks.shape)

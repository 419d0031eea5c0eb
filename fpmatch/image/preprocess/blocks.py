"""Fields on the square blocks of an image: means, blur, interpolation to pixels.

Block ``[i, j]`` is centred at pixel ``((j + 0.5)·BLOCK_PX, (i + 0.5)·BLOCK_PX)``; the last row and
column may reach beyond the image.
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Floats

BLOCK_PX: Final = 8  # side of a block, at 500 dpi
_CHANNELS: Final = 4  # that OpenCV blurs at a time


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


def blur_blocks(blocks: Floats, sigma_blocks: float) -> Floats:
    """Blur a field of blocks, (rows, columns) or (rows, columns, C), channel by channel."""
    planes = np.atleast_3d(np.asarray(blocks, np.float32))
    blurred = np.empty_like(planes)
    for start in range(0, planes.shape[2], _CHANNELS):
        part = np.ascontiguousarray(planes[:, :, start : start + _CHANNELS])
        blurred[:, :, start : start + _CHANNELS] = cv2.GaussianBlur(
            part, (0, 0), sigma_blocks, borderType=cv2.BORDER_REPLICATE
        ).reshape(part.shape)
    return blurred.reshape(blocks.shape)

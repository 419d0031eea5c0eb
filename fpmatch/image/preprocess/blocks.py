"""Fields on square cells of an image: blurred, and brought to pixels and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import cv2
import numpy as np

from fpmatch.image.preprocess import _blocks_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

_CHANNELS: Final = 4  # that OpenCV blurs at a time


class BlockGrid(Protocol):
    """What lies on cells of ``step_px`` pixels' side, over an image of ``shape`` (H, W)."""

    @property
    def step_px(self) -> int:
        """Side of a cell."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the image."""


@dataclass(frozen=True, slots=True)
class Blocks:
    """Cover an image of ``shape`` (H, W) by square cells of ``step_px`` pixels' side.

    Cell ``[i, j]`` is centred at pixel ``((j + 0.5)·step, (i + 0.5)·step)``; those of the last row
    and column may reach beyond the image.
    """

    step_px: int
    shape: tuple[int, int]


def blocks_to_pixels(cells: NDArray[np.float32], grid: BlockGrid) -> NDArray[np.float32]:
    """Interpolate a field of cells linearly.

    Parameters
    ----------
    cells : ndarray of float32, shape (rows, columns) or (rows, columns, C)
        A field on the cells of `grid`.
    grid : BlockGrid
        Tells the size of cells and image.

    Returns
    -------
    ndarray of float32, shape (H, W) or (H, W, C)
        The field at the pixels of the image.
    """
    height, width = grid.shape
    rows, columns = cells.shape[:2]
    step = grid.step_px
    large = cv2.resize(cells, (columns * step, rows * step), interpolation=cv2.INTER_LINEAR)
    return np.asarray(large[:height, :width], np.float32)


def pixels_to_blocks(pixels: NDArray[np.float32], grid: BlockGrid) -> NDArray[np.float32]:
    """Average a field of pixels (H, W) over each cell, shape (rows, columns)."""
    height, width = grid.shape
    step = grid.step_px
    below, beside = -height % step, -width % step
    whole = cv2.copyMakeBorder(pixels, 0, below, 0, beside, cv2.BORDER_REPLICATE)
    size = (whole.shape[1] // step, whole.shape[0] // step)
    return np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), np.float32)


def block_mean_product(
    a: NDArray[np.float32], b: NDArray[np.float32], grid: BlockGrid
) -> NDArray[np.float32]:
    """Average the product of two fields of pixels over each cell.

    Parameters
    ----------
    a, b : ndarray of float32, shape (H, W)
        Fields of pixels.
    grid : BlockGrid
        Tells the size of cells and image.

    Returns
    -------
    ndarray of float32, shape (rows, columns)
        The means; the last row and column of pixels are repeated where cells reach beyond them.

    Examples
    --------
    >>> waves = np.tile(np.float32([1, -1]), (8, 8))
    >>> block_mean_product(waves, waves, Blocks(8, (8, 16)))
    array([[1., 1.]], dtype=float32)
    """
    if not kernel.COMPILED:
        return pixels_to_blocks(np.asarray(a * b, np.float32), grid)
    step = grid.step_px
    rows, columns = (-(-side // step) for side in grid.shape)
    means = np.empty((rows, columns), np.float32)
    images = (np.ascontiguousarray(image, np.float32) for image in (a, b))
    kernel.mean_products(*images, step, np.empty(columns * step, np.float32), means)
    return means


def blur_blocks(cells: NDArray[np.float32], sigma_cells: float) -> NDArray[np.float32]:
    """Blur a field of cells, shape (rows, columns) or (rows, columns, C), channel by channel."""
    planes = np.atleast_3d(np.asarray(cells, np.float32))
    blurred = np.empty_like(planes)
    for start in range(0, planes.shape[2], _CHANNELS):
        part = np.ascontiguousarray(planes[:, :, start : start + _CHANNELS])
        blurred[:, :, start : start + _CHANNELS] = cv2.GaussianBlur(
            part, (0, 0), sigma_cells, borderType=cv2.BORDER_REPLICATE
        ).reshape(part.shape)
    return blurred.reshape(cells.shape)

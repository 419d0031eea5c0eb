"""Bare 2-D points: the check that all functions of this folder make, and cells."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry._grid_kernel import CellGrid

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

LARGEST: Final = sys.float_info.max  # number that float64 can hold
MAX_CELLS_PER_POINT: Final = 4
"""Cells are enlarged where the grid would have far more of them than points."""


def as_points(points: ArrayLike, name: str = "points") -> NDArray[np.float64]:
    """Return a copy of `points` as float64 (N, 2), of none if empty; else raise PointSetError.

    Coordinates reach ±2**300, so that no computation with them leaves float64.
    """
    try:
        array = np.array(points, dtype=np.float64, order="C")
    except (OverflowError, TypeError, ValueError) as error:
        raise PointSetError(f"{name}: expected an array of numbers of shape (N, 2)") from error
    if array.size == 0:
        return array.reshape(0, 2)
    if array.ndim != 2 or array.shape[1] != 2:
        raise PointSetError(f"{name}: expected an array of shape (N, 2), not {array.shape}")
    if not (np.abs(array) <= 2.0**300).all():
        raise PointSetError(f"{name}: coordinates must be finite, none beyond ±2**300")
    return array


def sort_into_cells(
    points: NDArray[np.float64],
    side: float,
    *,
    low: tuple[float, float],
    high: tuple[float, float],
    count: int | None = None,
) -> CellGrid:
    """Sort `points` (2, N), C order, writable, or the first `count` of them, into square cells.

    `low` and `high` are the corners of the grid; cells are larger than `side`, which is more than
    0, where there would be too many.
    """
    n = points.shape[1] if count is None else count
    width, height = high[0] - low[0], high[1] - low[1]
    most = MAX_CELLS_PER_POINT * max(n, 4)
    side = max(side, (width * height / most) ** 0.5, max(width, height) / most)
    grid: CellGrid = CellGrid(points, n, *low, side, int(width / side) + 1, int(height / side) + 1)
    return grid

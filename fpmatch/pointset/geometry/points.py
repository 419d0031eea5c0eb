"""Bare 2-D points: the check of every function of this room, coincident points, and cells."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry._grid_kernel import CellGrid, bounding_box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

Box = list[float]
"""Least and largest x, least and largest y."""

MAX_CELLS_PER_POINT: Final = 4
"""Cells are enlarged where the grid would have far more of them than points."""


def as_points(points: ArrayLike, name: str = "points") -> NDArray[np.float64]:
    """Return a copy of `points` as float64 (N, 2), of none if empty; else raise PointSetError."""
    return points_in_box(points, name)[0]


def points_in_box(points: ArrayLike, name: str = "points") -> tuple[NDArray[np.float64], Box]:
    """Return what `as_points` does, and the bounding box; zeros for no points."""
    try:
        array = np.array(points, dtype=np.float64, order="C")
    except (OverflowError, TypeError, ValueError) as error:
        raise PointSetError(f"{name}: expected an array of numbers of shape (N, 2)") from error
    if array.size == 0:
        return array.reshape(0, 2), [0.0] * 4
    if array.ndim != 2 or array.shape[1] != 2:
        raise PointSetError(f"{name}: expected an array of shape (N, 2), not {array.shape}")
    box = np.empty(4)
    if not bounding_box(array, box):
        raise PointSetError(f"{name}: coordinates must be finite")
    return array, box.tolist()


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


def unique_points(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the distinct points of a set (N, 2), and the index of each point among them."""
    distinct, index = np.unique(points, axis=0, return_inverse=True)
    return distinct, index.reshape(-1)


def pairs_of_coincident(
    pairs: NDArray[np.int32], index_p: NDArray[np.int64], index_q: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Return the pairs of points of two sets whose distinct points have the given `pairs`.

    `index_p` (N,) and `index_q` (M,) hold the index of each point among the distinct ones.
    Coincident points are paired in their order: the first with the first, the second with the
    second. The pairs (L, 2) are sorted by the first.
    """
    to_q = np.full(index_p.max() + 1, -1, np.int64)
    to_q[pairs[:, 0]] = pairs[:, 1]
    most = max(np.bincount(index_p).max(), np.bincount(index_q).max()) + 1
    # key of a point: the distinct point of Q it belongs to, and its number among those there
    partner = to_q[index_p]
    key_p = np.where(partner >= 0, partner * most + _number_of_repeat(index_p), -1)
    key_q = index_q * most + _number_of_repeat(index_q)
    _, in_p, in_q = np.intersect1d(key_p, key_q, return_indices=True)
    paired = np.column_stack([in_p, in_q]).astype(np.int32)
    return paired[paired[:, 0].argsort()]


def _number_of_repeat(index: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many earlier points coincide with each point."""
    order = index.argsort(kind="stable")
    in_order = index[order]
    number = np.empty(len(index), np.int64)
    number[order] = np.arange(len(index)) - in_order.searchsorted(in_order, "left")
    return number


def is_finite(value: float) -> bool:
    """Return whether a number is one that float64 can hold."""
    try:
        return math.isfinite(value)
    except OverflowError:  # an int
        return False

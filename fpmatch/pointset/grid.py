"""Sort points into the cells of a grid, in which kernels find what is near a place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.pointset.geometry._grid_kernel import CellGrid

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAX_CELLS_PER_POINT: Final = 4
"""Cells are enlarged where the grid would have far more of them than points."""


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

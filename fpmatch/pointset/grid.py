"""Sort points into the cells of a grid, in which kernels find what is near a place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.pointset._grid_kernel import CellGrid

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
    """Sort points into square cells.

    Parameters
    ----------
    points : ndarray of float64, shape (2, N)
        The points; C order, writable.
    side : float
        Side of a cell, more than 0; larger ones are used where these would be too many.
    low, high : tuple of float
        Corners of the grid: x and y.
    count : int, optional
        How many of the points to sort; all by default.

    Returns
    -------
    CellGrid
        The grid; its points are in the order of the cells.

    Examples
    --------
    >>> import numpy as np
    >>> grid = sort_into_cells(np.array([[5.0, 1.0], [5.0, 1.0]]), 2.0, low=(0, 0), high=(6, 6))
    >>> grid.order[grid.nearest(4.0, 4.0, 3.0)]
    0
    """
    n = points.shape[1] if count is None else count
    width, height = high[0] - low[0], high[1] - low[1]
    most = MAX_CELLS_PER_POINT * max(n, 4)
    side = max(side, (width * height / most) ** 0.5, max(width, height) / most)
    grid: CellGrid = CellGrid(points, n, *low, side, int(width / side) + 1, int(height / side) + 1)
    return grid

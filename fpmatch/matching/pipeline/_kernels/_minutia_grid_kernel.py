# mypy: ignore-errors
"""Kernel: a grid that finds the minutiae near a place."""

import cython
import numpy as np

CELL_PX = cython.declare(cython.double, 16.0)
MOST_CELLS = cython.declare(cython.int, 32)  # across the bounding box; larger cells if need be
MOST_REACHED = cython.declare(cython.int, 6)  # cells in a line within the reach of one minutia
MARGIN = cython.declare(cython.double, 0.01)  # px, more than the rounding error of a cell's border


@cython.final
@cython.cclass
class MinutiaGrid:
    """The minutiae of one print, at most `size`, listed by the cells of a square grid.

    ``item[start[k] : start[k + 1]]`` are the indices, ascending, of all minutiae within
    `reach_px` of any place in cell k. Cells are counted along the rows; there are `rows` by
    `columns`, of side ``1 / per_px``, from the corner (x0, y0) on.
    """

    def __init__(self, reach_px, size) -> None:
        self.reach = reach_px + MARGIN
        self.start = np.zeros((MOST_CELLS + MOST_REACHED) ** 2 + 2, np.int32)
        self.item = np.empty(MOST_REACHED * MOST_REACHED * size, np.int32)
        self.columns = self.rows = 0
        self.x0 = self.y0 = self.per_px = 0.0

    @cython.locals(filling=cython.int, row=cython.int, column=cython.int, j=cython.Py_ssize_t)
    def load(self, points, size):
        """List the first `size` columns of `points` (4, N); return 0."""
        reach = self.reach
        self.columns = self.rows = 0
        if size == 0:
            return 0
        self.x0 = x1 = points[0, 0]
        self.y0 = y1 = points[1, 0]
        for j in range(size):
            self.x0 = points[0, j] if points[0, j] < self.x0 else self.x0
            self.y0 = points[1, j] if points[1, j] < self.y0 else self.y0
            x1 = points[0, j] if points[0, j] > x1 else x1
            y1 = points[1, j] if points[1, j] > y1 else y1
        side = max(x1 - self.x0, y1 - self.y0) / MOST_CELLS
        self.per_px = 1.0 / max(side, CELL_PX, 0.5 * reach)
        self.x0 -= reach
        self.y0 -= reach
        self.columns = self._line(x1 + reach - self.x0) + 1
        self.rows = self._line(y1 + reach - self.y0) + 1
        cells: cython.Py_ssize_t = self.columns * self.rows
        for cell in range(cells + 2):
            self.start[cell] = 0
        # the starts run one ahead while the cells are filled, two while their items are counted
        for filling in range(2):
            for j in range(size):
                first_column = self._line(points[0, j] - reach - self.x0)
                last_column = self._line(points[0, j] + reach - self.x0)
                first_row = self._line(points[1, j] - reach - self.y0)
                last_row = self._line(points[1, j] + reach - self.y0)
                for row in range(first_row, last_row + 1):
                    for column in range(first_column, last_column + 1):
                        cell = row * self.columns + column
                        if filling:
                            self.item[self.start[cell + 1]] = j
                        self.start[cell + 2 - filling] += 1
            if not filling:
                for cell in range(cells):
                    self.start[cell + 2] += self.start[cell + 1]
        return 0

    def _line(self, place):
        """Return the row or column of the grid at a distance from its first."""
        return int(place * self.per_px)

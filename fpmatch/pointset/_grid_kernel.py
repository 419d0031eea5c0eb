"""Kernel: the bounding box of points, and points sorted into the cells of a square grid.

Interpreted, the functions run as they stand.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.libc.math import sqrt
else:
    from math import sqrt

COMPILED = cython.compiled


def bounding_box(points, box):
    """Write least and largest x, least and largest y of points (N, 2), N > 0.

    Returned is whether all coordinates are finite; only then is the box of any use.
    """
    most = 1.7976931348623157e308
    left = right = points[0, 0]
    top = bottom = points[0, 1]
    finite = True
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        if not (-most <= x <= most and -most <= y <= most):
            finite = False
        left, right = min(left, x), max(right, x)
        top, bottom = min(top, y), max(bottom, y)
    box[0], box[1], box[2], box[3] = left, right, top, bottom
    return finite


def _cell_at(place, cells):
    """Return the column or row of a place in cells, the first or the last where it is outside."""
    if not place > 0.0:
        return 0
    if place >= cells:
        return cells - 1
    return int(place)


class CellGrid:
    """Points sorted into cells.

    Cell k, counted along the rows, holds the points ``start[k]`` to ``start[k + 1]`` of the arrays
    `x` and `y`, which are in the order of the cells; ``order`` holds their indices in `points`.
    Points outside the grid belong to its nearest cell.

    The first `count` of `points` (2, N) are sorted; `x0`, `y0` is the corner of the first cell and
    `side` the side of each.
    """

    @cython.locals(
        points=cython.double[:, ::1], count=cython.Py_ssize_t, x0=cython.double,
        y0=cython.double, side=cython.double, columns=cython.int, rows=cython.int,
        i=cython.Py_ssize_t, k=cython.Py_ssize_t, cells=cython.Py_ssize_t,
        start=cython.int[::1],
    )  # fmt: skip
    def __init__(self, points, count, x0, y0, side, columns, rows):
        cells = columns * rows
        self.x, self.y = np.empty(count), np.empty(count)
        self.order = np.empty(count, np.intc)
        self.start = start = np.zeros(cells + 1, np.intc)
        self.x0, self.y0 = x0, y0
        self.x1, self.y1 = x0 + side * columns, y0 + side * rows
        self.per_unit = 1.0 / side
        self.columns = columns
        self.rows = rows
        for i in range(count):
            start[self._cell(points[0, i], points[1, i]) + 1] += 1
        for k in range(cells):
            start[k + 1] += start[k]
        # from here on start[k] runs ahead to the end of cell k, which is the start of the next
        for i in range(count):
            k = self._cell(points[0, i], points[1, i])
            self.x[start[k]], self.y[start[k]] = points[0, i], points[1, i]
            self.order[start[k]] = i
            start[k] += 1
        for k in range(cells, 0, -1):
            start[k] = start[k - 1]
        start[0] = 0

    def _cell(self, x, y):
        row: cython.Py_ssize_t = _cell_at((y - self.y0) * self.per_unit, self.rows)
        return row * self.columns + _cell_at((x - self.x0) * self.per_unit, self.columns)

    def around(self, x, y, reach):
        """Return the first column and row of the cells within reach, and the ones past the last."""
        return (
            _cell_at((x - reach - self.x0) * self.per_unit, self.columns),
            _cell_at((y - reach - self.y0) * self.per_unit, self.rows),
            _cell_at((x + reach - self.x0) * self.per_unit, self.columns) + 1,
            _cell_at((y + reach - self.y0) * self.per_unit, self.rows) + 1,
        )

    def nearest(self, x, y, reach2):
        """Return the nearest point, in the order of the cells, nearer than √reach2, or -1."""
        left, top, right, bottom = self.around(x, y, sqrt(reach2))
        best = -1
        for row in range(top, bottom):
            for k in range(
                self.start[row * self.columns + left], self.start[row * self.columns + right]
            ):
                dx, dy = self.x[k] - x, self.y[k] - y
                distance2 = dx * dx + dy * dy
                if distance2 < reach2:
                    reach2 = distance2
                    best = k
        return best

    def within(self, x, y, reach2, most, near, distance2, at):
        """Write the points within √reach2, nearest first, from entry `at` on; return how many.

        Of more than `most`, the nearest are written.
        """
        left, top, right, bottom = self.around(x, y, sqrt(reach2))
        found = 0
        for row in range(top, bottom):
            for k in range(
                self.start[row * self.columns + left], self.start[row * self.columns + right]
            ):
                dx, dy = self.x[k] - x, self.y[k] - y
                d2 = dx * dx + dy * dy
                if d2 > reach2 or (found == most and d2 >= distance2[at + found - 1]):
                    continue
                if found < most:
                    found += 1
                e = at + found - 1
                while e > at and distance2[e - 1] > d2:
                    distance2[e] = distance2[e - 1]
                    near[e] = near[e - 1]
                    e -= 1
                distance2[e] = d2
                near[e] = k
        return found

# mypy: ignore-errors
"""Kernel: points sorted into the cells of a square grid. Interpreted, it runs as it stands."""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.libc.math import sqrt
else:
    from math import sqrt

COMPILED = cython.compiled

_CROWD = cython.declare(cython.int, 16)  # points of a cell that are searched one after the other


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

    Where points crowd in few cells, `split_crowds` makes each of these a k-d tree, so that a search
    does not visit all their points.
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
        self.axis = np.empty(0, np.uint8)
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

    @cython.locals(row=cython.Py_ssize_t, k=cython.Py_ssize_t)
    def nearest(self, x, y, reach2):
        """Return the nearest point, in the order of the cells, nearer than √reach2, or -1."""
        left, top, right, bottom = self.around(x, y, sqrt(reach2))
        best: cython.int = -1
        for row in range(top, bottom):
            begin = self.start[row * self.columns + left]
            end = self.start[row * self.columns + right]
            if self.axis.shape[0] > 0 and end - begin > _CROWD:
                for cell in range(row * self.columns + left, row * self.columns + right):
                    best, reach2 = self._nearest_in_tree(
                        self.start[cell], self.start[cell + 1], x, y, best, reach2
                    )
                continue
            for k in range(begin, end):
                dx, dy = self.x[k] - x, self.y[k] - y
                distance2 = dx * dx + dy * dy
                if distance2 < reach2:
                    reach2 = distance2
                    best = k
        return best

    def _nearest_in_tree(self, low, high, x, y, best, reach2):
        """Return the nearest of `best` and the points low..high of a cell, and its distance²."""
        while high - low > _CROWD:
            middle = (low + high) // 2
            dx, dy = self.x[middle] - x, self.y[middle] - y
            distance2 = dx * dx + dy * dy
            if distance2 < reach2:
                best, reach2 = middle, distance2
            away = dy if self.axis[middle] else dx
            if away > 0.0:
                best, reach2 = self._nearest_in_tree(low, middle, x, y, best, reach2)
                low = middle + 1
            else:
                best, reach2 = self._nearest_in_tree(middle + 1, high, x, y, best, reach2)
                high = middle
            if away * away >= reach2:
                return best, reach2
        for k in range(low, high):
            dx, dy = self.x[k] - x, self.y[k] - y
            distance2 = dx * dx + dy * dy
            if distance2 < reach2:
                best, reach2 = k, distance2
        return best, reach2

    @cython.locals(row=cython.Py_ssize_t, k=cython.Py_ssize_t)
    def within(self, x, y, reach2, most, near, distance2, at):
        """Write the points within √reach2, nearest first, from entry `at` on; return how many.

        Of more than `most`, the nearest are written.
        """
        left, top, right, bottom = self.around(x, y, sqrt(reach2))
        found: cython.int = 0
        for row in range(top, bottom):
            begin = self.start[row * self.columns + left]
            end = self.start[row * self.columns + right]
            if self.axis.shape[0] > 0 and end - begin > _CROWD:
                for cell in range(row * self.columns + left, row * self.columns + right):
                    found = self._within_tree(
                        self.start[cell], self.start[cell + 1], x, y, reach2, most, near,
                        distance2, at, found,
                    )  # fmt: skip
                continue
            for k in range(begin, end):
                found = self._insert(k, x, y, reach2, most, near, distance2, at, found)
        return found

    def _within_tree(self, low, high, x, y, reach2, most, near, distance2, at, found):
        """Insert the points low..high of a cell as `_insert` does; return the new number."""
        while high - low > _CROWD:
            middle = (low + high) // 2
            found = self._insert(middle, x, y, reach2, most, near, distance2, at, found)
            away = self.y[middle] - y if self.axis[middle] else self.x[middle] - x
            if away > 0.0:
                found = self._within_tree(
                    low, middle, x, y, reach2, most, near, distance2, at, found
                )
                low = middle + 1
            else:
                found = self._within_tree(
                    middle + 1, high, x, y, reach2, most, near, distance2, at, found
                )
                high = middle
            if away * away > reach2 or (found == most and away * away >= distance2[at + found - 1]):
                return found
        for k in range(low, high):
            found = self._insert(k, x, y, reach2, most, near, distance2, at, found)
        return found

    def _insert(self, k, x, y, reach2, most, near, distance2, at, found):
        """Insert point k, if it is within √reach2 and of the `most` nearest; return the number."""
        dx, dy = self.x[k] - x, self.y[k] - y
        d2 = dx * dx + dy * dy
        if d2 > reach2 or (found == most and d2 >= distance2[at + found - 1]):
            return found
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

    def split_crowds(self):
        """Sort the points of each cell with more than `_CROWD` into a k-d tree.

        The point in the middle of a range splits it: along x where ``axis`` is 0 there, else y;
        each range is split by its wider side.
        """
        start = np.asarray(self.start)
        cells = np.flatnonzero(np.diff(start) > _CROWD)
        if not len(cells):
            return
        ranges = np.column_stack([start[cells], start[cells + 1]]).tolist()
        self.axis = np.zeros(self.x.shape[0], np.uint8)
        xy, order = np.array([self.x, self.y]), np.array(self.order)
        while ranges:
            low, high = ranges.pop()
            middle = (low + high) // 2
            width, height = np.ptp(xy[:, low:high], axis=1)
            self.axis[middle] = height > width
            moved = low + np.argpartition(xy[int(height > width), low:high], middle - low)
            xy[:, low:high], order[low:high] = xy[:, moved], order[moved]
            for part in ((low, middle), (middle + 1, high)):
                if part[1] - part[0] > _CROWD:
                    ranges.append(part)
        self.x, self.y, self.order = xy[0], xy[1], order

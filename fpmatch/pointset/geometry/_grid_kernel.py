# mypy: ignore-errors
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

_CROWD = cython.declare(cython.int, 16)  # points of a cell that are searched one after the other


@cython.locals(i=cython.Py_ssize_t)
def bounding_box(points, box):
    """Write least and largest x, least and largest y of points (N, 2), N > 0.

    Returned is whether all coordinates are within ±2**300; only then is the box of any use.
    """
    most = 2.0**300
    left = right = points[0, 0]
    top = bottom = points[0, 1]
    moderate = True
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        if not (-most <= x <= most and -most <= y <= most):
            moderate = False
        left, right = min(left, x), max(right, x)
        top, bottom = min(top, y), max(bottom, y)
    box[0], box[1], box[2], box[3] = left, right, top, bottom
    return moderate


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

    @cython.locals(cell=cython.Py_ssize_t)
    def split_crowds(self):
        """Sort the points of each cell with more than `_CROWD` into a k-d tree.

        The point in the middle of a range splits it: along x where ``axis`` is 0 there, else y.
        """
        for cell in range(self.columns * self.rows):
            if self.start[cell + 1] - self.start[cell] > _CROWD:
                if self.axis.shape[0] == 0:
                    self.axis = np.zeros(self.x.shape[0], np.uint8)
                self._split(self.start[cell], self.start[cell + 1])

    def _split(self, low, high):
        """Sort the points low..high into a k-d tree, each range by its wider side."""
        while high - low > _CROWD:
            left = right = self.x[low]
            top = bottom = self.y[low]
            for k in range(low + 1, high):
                left, right = min(left, self.x[k]), max(right, self.x[k])
                top, bottom = min(top, self.y[k]), max(bottom, self.y[k])
            middle = (low + high) // 2
            self.axis[middle] = bottom - top > right - left
            self._select(low, high - 1, middle, self.y if self.axis[middle] else self.x)
            self._split(low, middle)
            low = middle + 1

    def _select(self, low, high, middle, value):
        """Exchange points low..high until none before the middle has a larger value, none a less.

        This is Hoare's selection; equal values are exchanged too, which keeps it fast.
        """
        while low < high:
            pivot = value[(low + high) // 2]
            i, j = low, high
            while i <= j:
                while value[i] < pivot:
                    i += 1
                while value[j] > pivot:
                    j -= 1
                if i <= j:
                    self.x[i], self.x[j] = self.x[j], self.x[i]
                    self.y[i], self.y[j] = self.y[j], self.y[i]
                    self.order[i], self.order[j] = self.order[j], self.order[i]
                    i += 1
                    j -= 1
            if middle <= j:
                high = j
            elif middle >= i:
                low = i
            else:
                break


@cython.locals(e=cython.Py_ssize_t)
def find_candidates(p, grid, move, t2, most, start, near, cost):
    """Write the points of Q within t of each moved point of P, nearest first, at most `most`.

    Those of point i are the entries ``start[i]`` to ``start[i + 1]`` of ``near``; their cost is
    d² - t², at most 0.
    """
    start[0] = 0
    for i in range(p.shape[1]):
        x = move[2] + move[0] * p[0, i] - move[1] * p[1, i]
        y = move[3] + move[1] * p[0, i] + move[0] * p[1, i]
        start[i + 1] = start[i] + grid.within(x, y, t2, most, near, cost, start[i])
        for e in range(start[i], start[i + 1]):
            cost[e] -= t2
    return start[p.shape[1]]

"""Kernel: points sorted into the cells of a square grid, and the one nearest to a place.

Cell k, counted along the rows, holds the points ``start[k]`` to ``start[k + 1]`` of the arrays `x`
and `y`, which are in the order of the cells; ``order`` says which of the points as given they are.
Points outside the grid belong to its nearest cell. Interpreted, the class runs as it stands.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import sqrt
else:
    from math import sqrt

COMPILED = cython.compiled


@cython.final
@cython.cclass
class CellGrid:
    """A set of points sorted into cells; its arrays are the caller's, to be filled here.

    `given`, shape (2, N), begins with the `count` points; `x`, `y` and `order` have that number,
    `start` one entry more than there are cells; `x0`, `y0` is the corner of the first cell, `side`
    the side of each.
    """

    @cython.locals(
        given=cython.double[:, ::1],
        x=cython.double[::1],
        y=cython.double[::1],
        order=cython.int[::1],
        start=cython.int[::1],
        x0=cython.double,
        y0=cython.double,
        side=cython.double,
        columns=cython.int,
        rows=cython.int,
        i=cython.Py_ssize_t,
        k=cython.Py_ssize_t,
        count=cython.Py_ssize_t,
        cells=cython.Py_ssize_t,
    )
    @cython.boundscheck(False)
    @cython.wraparound(False)
    def __init__(self, given, count, x, y, order, start, x0, y0, side, columns, rows):
        self.x = x
        self.y = y
        self.order = order
        self.start = start
        self.x0 = x0
        self.y0 = y0
        self.per_unit = 1.0 / side
        self.columns = columns
        self.rows = rows
        self.x1 = x0 + side * columns
        self.y1 = y0 + side * rows
        cells = columns * rows
        for k in range(cells + 1):
            start[k] = 0
        for i in range(count):
            start[self._cell(given[0, i], given[1, i]) + 1] += 1
        for k in range(cells):
            start[k + 1] += start[k]
        # from here on start[k] runs ahead to the end of cell k, which is the start of the next
        for i in range(count):
            k = self._cell(given[0, i], given[1, i])
            x[start[k]] = given[0, i]
            y[start[k]] = given[1, i]
            order[start[k]] = cython.cast(cython.int, i)
            start[k] += 1
        for k in range(cells, 0, -1):
            start[k] = start[k - 1]
        start[0] = 0

    @cython.cfunc
    @cython.exceptval(check=False)
    def _cell(self, x: cython.double, y: cython.double) -> cython.Py_ssize_t:
        row: cython.Py_ssize_t = self.row(y)
        return row * self.columns + self.column(x)

    @cython.ccall
    @cython.exceptval(check=False)
    def column(self, x: cython.double) -> cython.int:
        """Return the column of x, the first or the last where x is outside."""
        place: cython.double = (x - self.x0) * self.per_unit
        if not place > 0.0:
            return 0
        if place >= self.columns:
            return self.columns - 1
        return cython.cast(cython.int, place)

    @cython.ccall
    @cython.exceptval(check=False)
    def row(self, y: cython.double) -> cython.int:
        """Return the row of y, the first or the last where y is outside."""
        place: cython.double = (y - self.y0) * self.per_unit
        if not place > 0.0:
            return 0
        if place >= self.rows:
            return self.rows - 1
        return cython.cast(cython.int, place)

    @cython.ccall
    @cython.exceptval(check=False)
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    def nearest(self, x: cython.double, y: cython.double, reach2: cython.double) -> cython.int:
        """Return the nearest point, in the order of the cells, nearer than √reach2, or -1."""
        reach: cython.double = sqrt(reach2)
        low_column: cython.Py_ssize_t = self.column(x - reach)
        high_column: cython.Py_ssize_t = self.column(x + reach)
        low_row: cython.int = self.row(y - reach)
        high_row: cython.int = self.row(y + reach)
        row: cython.Py_ssize_t
        k: cython.Py_ssize_t
        best: cython.Py_ssize_t = -1
        closest: cython.double = reach2
        dx: cython.double
        dy: cython.double
        for row in range(low_row, high_row + 1):
            for k in range(
                self.start[row * self.columns + low_column],
                self.start[row * self.columns + high_column + 1],
            ):
                dx = self.x[k] - x
                dy = self.y[k] - y
                dx = dx * dx + dy * dy
                if dx < closest:
                    closest = dx
                    best = k
        return cython.cast(cython.int, best)

    @cython.ccall
    @cython.exceptval(check=False)
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    def within(
        self,
        x: cython.double,
        y: cython.double,
        reach2: cython.double,
        most: cython.int,
        near: cython.int[::1],
        distance2: cython.double[::1],
        at: cython.Py_ssize_t,
    ) -> cython.int:
        """Write the points within √reach2, nearest first, from entry `at` on; return how many.

        Of more than `most`, the nearest are written.
        """
        reach: cython.double = sqrt(reach2)
        low_column: cython.Py_ssize_t = self.column(x - reach)
        high_column: cython.Py_ssize_t = self.column(x + reach)
        low_row: cython.int = self.row(y - reach)
        high_row: cython.int = self.row(y + reach)
        found: cython.Py_ssize_t = 0
        row: cython.Py_ssize_t
        k: cython.Py_ssize_t
        e: cython.Py_ssize_t
        dx: cython.double
        dy: cython.double
        for row in range(low_row, high_row + 1):
            for k in range(
                self.start[row * self.columns + low_column],
                self.start[row * self.columns + high_column + 1],
            ):
                dx = self.x[k] - x
                dy = self.y[k] - y
                dx = dx * dx + dy * dy
                if dx > reach2 or (found == most and dx >= distance2[at + found - 1]):
                    continue
                if found < most:
                    found += 1
                e = at + found - 1
                while e > at and distance2[e - 1] > dx:
                    distance2[e] = distance2[e - 1]
                    near[e] = near[e - 1]
                    e -= 1
                distance2[e] = dx
                near[e] = cython.cast(cython.int, k)
        return cython.cast(cython.int, found)

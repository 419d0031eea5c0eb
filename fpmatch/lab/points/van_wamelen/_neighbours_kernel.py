# mypy: ignore-errors
"""Kernel: nearest neighbours in a grid, counted, and the area of a convex hull.

Indices of points are indices into the order of the grid's cells. `steps` (1,) counts the points and
cells visited, the measure of work done.
"""

import cython

COMPILED = cython.compiled


@cython.locals(count=cython.int, shell=cython.int, line=cython.int, step=cython.int)
def find_neighbours(grid, i, near, squared, steps):
    """Write the nearest neighbours of point i, by distance and then by index, into `near` (k,).

    `squared` receives their squared distances. The set has more than k points. Cells are searched
    in square shells around the point's own, until no other can hold a neighbour.
    """
    count = shell = 0
    x, y = grid.x[i], grid.y[i]
    column, row, _, _ = grid.around(x, y, 0.0)
    while True:
        left: cython.int = column - shell if column > shell else 0
        right: cython.int = column + shell if column + shell < grid.columns else grid.columns - 1
        for line in range(
            row - shell if row > shell else 0,
            (row + shell if row + shell < grid.rows else grid.rows - 1) + 1,
        ):
            first = line * grid.columns
            if line == row - shell or line == row + shell:
                count = _insert_cells(
                    grid, i, first + left, first + right, near, squared, count, steps
                )
                continue
            for step in range(column - shell, column + shell + 1, 2 * shell):
                if 0 <= step < grid.columns:
                    count = _insert_cells(
                        grid, i, first + step, first + step, near, squared, count, steps
                    )
        gap = _distance_outside(x * grid.per_unit, column, shell, grid.columns)
        gap = min(gap, _distance_outside(y * grid.per_unit, row, shell, grid.rows))
        gap = max(gap, 0.0) / grid.per_unit
        if count == near.shape[0] and squared[count - 1] < gap * gap:
            break
        shell += 1
        if shell >= grid.rows and shell >= grid.columns:
            break


def _insert_cells(grid, i, first, last, near, squared, count, steps):
    """Insert the points of cells first to last, but i, into the list; return its new length."""
    k: cython.int = near.shape[0]
    steps[0] += 1 + grid.start[last + 1] - grid.start[first]
    for j in range(grid.start[first], grid.start[last + 1]):
        dx, dy = grid.x[j] - grid.x[i], grid.y[j] - grid.y[i]
        distance = dx * dx + dy * dy
        if j == i or (
            count == k
            and (distance > squared[k - 1] or (distance == squared[k - 1] and j > near[k - 1]))
        ):
            continue
        at: cython.int = count if count < k else k - 1
        while at > 0 and (
            distance < squared[at - 1] or (distance == squared[at - 1] and j < near[at - 1])
        ):
            squared[at], near[at] = squared[at - 1], near[at - 1]
            at -= 1
        squared[at], near[at] = distance, j
        count = min(count + 1, k)
    return count


def _distance_outside(value, cell, shell, cells):
    """Return the distance, in cells, of `value` from the cells beyond the shell along one axis."""
    rounding = 1e-9
    gap: cython.double = cells
    if cell - shell > 0:
        gap = min(gap, value - (cell - shell))
    if cell + shell + 1 < cells:
        gap = min(gap, cell + shell + 1 - value)
    return gap - rounding


@cython.locals(a=cython.int, b=cython.int)
def hull_area(point, corner):
    """Return the area of the convex hull of `point` (2, N), sorted by x and then y.

    `corner` (N + 1,) is work space: the lower side of the hull, then the upper.
    """
    n: cython.int = point.shape[1]
    twice = 0.0
    for side in range(2):
        count: cython.int = 0
        for i in range(n):
            c: cython.int = i if side == 0 else n - 1 - i
            while count >= 2:
                a, b = corner[count - 2], corner[count - 1]
                if (point[0, b] - point[0, a]) * (point[1, c] - point[1, a]) > (
                    point[1, b] - point[1, a]
                ) * (point[0, c] - point[0, a]):
                    break
                count -= 1
            corner[count] = c
            count += 1
        for i in range(count - 1):
            a, b = corner[i], corner[i + 1]
            twice += (point[0, a] - point[0, 0]) * (point[1, b] - point[1, 0]) - (
                point[1, a] - point[1, 0]
            ) * (point[0, b] - point[0, 0])
    return twice / 2.0

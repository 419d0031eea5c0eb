# mypy: ignore-errors
"""Kernel: the terms of a print, which are the edges of its Delaunay mesh, quantised.

An edge from one minutia to another has a length, the directions of both minutiae relative to it,
and the curvature of the ridges across it: by how much the ridge orientation on its left side
differs from that on its right side. A term is the cell of these four numbers; none changes when the
print is moved or turned. A pose is where the edge lies in the print, and which way it points.
"""

import cython
from cython.cimports.libc.math import atan2, floor, log1p, sqrt

FULL_TURN = cython.declare(cython.double, 6.283185307179586)
# A length has an error of LENGTH_ERROR_PX, and GROWTH of itself more; its cells are as wide as 2.5
# of these errors. `terms` has the same numbers.
LENGTH_ERROR_PX = cython.declare(cython.double, 2.5)
GROWTH = cython.declare(cython.double, 0.03)
WIDTH = cython.declare(cython.double, 2.5)
LENGTHS = cython.declare(cython.int, 14)  # cells of length; longer edges are in the last
SECTORS = cython.declare(cython.int, 24)  # of a direction relative to the edge
CURVATURES = cython.declare(cython.int, 7)  # cells of curvature; the last is that of unknown ones
MODERATE = cython.declare(cython.double, 0.2617993877991494)  # 15 degrees: borders of these cells
STRONG = cython.declare(cython.double, 0.6108652381980153)  # 35 degrees
UNKNOWN = cython.declare(cython.double, 4.0)  # greater than any curvature
SIDE_PX = cython.declare(cython.double, 28.0)  # from the middle of an edge to either side of it
LEAST_KNOWN = cython.declare(cython.double, 0.25)  # square of the length of a mean orientation
ROTATIONS = cython.declare(cython.int, 64)  # steps of an edge's own direction
PLACES = cython.declare(cython.int, 32)  # steps of a place along x and y, after which they repeat
PER_PX = cython.declare(cython.double, 0.125)  # steps of a place


@cython.locals(i=cython.Py_ssize_t, j=cython.Py_ssize_t, side=cython.int, k=cython.int)
def measure_curvatures(points, edge, code, doubled, step, first_row, first_column, curvature):
    """Fill `curvature` (E,) for the edges (E, 2) of a mesh, in radians: `UNKNOWN` where it is not.

    `points` are x, y and the unit vector of the direction (4, N), in pixels at 500 dpi, y pointing
    up. `code` are the ridge orientations of square cells, of a side of `step` pixels, the first of
    which is in that row and column; `doubled` (2, 256) is the unit vector at twice the angle of
    each code, and 0 for what is no orientation.
    """
    for e in range(edge.shape[0]):
        i, j = edge[e, 0], edge[e, 1]
        dx = points[0, j] - points[0, i]
        dy = points[1, j] - points[1, i]
        length = sqrt(dx * dx + dy * dy)
        scale = SIDE_PX / length if length > 0.0 else 0.0
        curvature[e] = UNKNOWN
        c = s = 1.0
        known: cython.bint = length > 0.0
        for side in range(2):
            x = (0.5 * (points[0, i] + points[0, j]) - scale * dy) / step - first_column - 0.5
            y = -(0.5 * (points[1, i] + points[1, j]) + scale * dx) / step - first_row - 0.5
            scale = -scale
            column, row = floor(x), floor(y)
            mean_c = mean_s = 0.0
            for k in range(4):
                at_x, at_y = column + (k & 1), row + (k >> 1)
                if 0 <= at_x < code.shape[1] and 0 <= at_y < code.shape[0]:
                    share = (x - column if k & 1 else 1.0 - (x - column)) * (
                        y - row if k >> 1 else 1.0 - (y - row)
                    )
                    which: cython.int = code[int(at_y), int(at_x)]
                    mean_c += share * doubled[0, which]
                    mean_s += share * doubled[1, which]
            known = known and mean_c * mean_c + mean_s * mean_s > LEAST_KNOWN
            if side == 0:
                c, s = mean_c, mean_s
        if known:
            curvature[e] = 0.5 * atan2(s * mean_c - c * mean_s, c * mean_c + s * mean_s)
    return 0


@cython.locals(i=cython.Py_ssize_t, j=cython.Py_ssize_t)
def describe_edges(points, edge, curvature, term, pose):
    """Fill `term` and `pose` for the edges (E, 2) of a mesh, each from its first end to its second.

    `points` are x, y and the unit vector of the direction (4, N), in pixels at 500 dpi; `curvature`
    is what `measure_curvatures` fills.
    """
    for e in range(edge.shape[0]):
        i, j = edge[e, 0], edge[e, 1]
        dx = points[0, j] - points[0, i]
        dy = points[1, j] - points[1, i]
        length = sqrt(dx * dx + dy * dy)
        along = atan2(dy, dx)
        bin_: cython.int = int(log1p(GROWTH / LENGTH_ERROR_PX * length) / GROWTH / WIDTH)
        cell: cython.int = bin_ if bin_ < LENGTHS else LENGTHS - 1
        cell = cell * SECTORS + sector(atan2(points[3, i], points[2, i]) - along, SECTORS)
        cell = cell * SECTORS + sector(atan2(points[3, j], points[2, j]) - along, SECTORS)
        cell = cell * CURVATURES + (curvature[e] > -STRONG) + (curvature[e] > -MODERATE)
        cell += (curvature[e] > 0.0) + (curvature[e] > MODERATE) + (curvature[e] > STRONG)
        term[e] = cell + (curvature[e] >= UNKNOWN)
        x: cython.int = int(floor(0.5 * (points[0, i] + points[0, j]) * PER_PX))
        y: cython.int = int(floor(0.5 * (points[1, i] + points[1, j]) * PER_PX))
        cell = sector(along + 0.5 * FULL_TURN / ROTATIONS, ROTATIONS)
        pose[e] = (cell * PLACES + (x & (PLACES - 1))) * PLACES + (y & (PLACES - 1))
    return 0


def sector(angle, count):
    """Return in which of so many equal parts of a turn an angle lies."""
    share = angle / FULL_TURN
    share -= floor(share)
    bin_: cython.int = int(share * count)
    return bin_ if bin_ < count else count - 1

"""Kernel: the terms of a print, which are the edges of its Delaunay mesh, quantised.

An edge from one minutia to another has a length and the directions of both minutiae relative to
it. A term is the cell of these three numbers; none changes when the print is moved or turned. A
pose is where the edge lies in the print, and which way it points.
"""

import cython
from cython.cimports.libc.math import atan2, floor, log1p, sqrt

FULL_TURN = cython.declare(cython.double, 6.283185307179586)
# A length has an error of LENGTH_ERROR_PX, and GROWTH of itself more; its cells are as wide as 1.7
# of these errors. `fpmatch.indexing.terms` has the same numbers.
LENGTH_ERROR_PX = cython.declare(cython.double, 2.5)
GROWTH = cython.declare(cython.double, 0.03)
WIDTH = cython.declare(cython.double, 1.7)
LENGTHS = cython.declare(cython.int, 21)  # cells of length; longer edges are in the last
SECTORS = cython.declare(cython.int, 36)  # of a direction relative to the edge
ROTATIONS = cython.declare(cython.int, 64)  # steps of an edge's own direction
PLACES = cython.declare(cython.int, 32)  # steps of a place along x and y, after which they repeat
PER_PX = cython.declare(cython.double, 0.125)  # steps of a place


def describe_edges(points, edge, term, pose):
    """Fill `term` and `pose` for the edges (E, 2) of a mesh, each from its first end to its second.

    `points` are x, y and the unit vector of the direction (4, N), in pixels at 500 dpi.
    """
    for e in range(edge.shape[0]):
        i, j = edge[e, 0], edge[e, 1]
        dx = points[0, j] - points[0, i]
        dy = points[1, j] - points[1, i]
        length = sqrt(dx * dx + dy * dy)
        along = atan2(dy, dx)
        bin_ = int(log1p(GROWTH / LENGTH_ERROR_PX * length) / GROWTH / WIDTH)
        cell = bin_ if bin_ < LENGTHS else LENGTHS - 1
        cell = cell * SECTORS + sector(atan2(points[3, i], points[2, i]) - along, SECTORS)
        cell = cell * SECTORS + sector(atan2(points[3, j], points[2, j]) - along, SECTORS)
        term[e] = cell
        x = int(floor(0.5 * (points[0, i] + points[0, j]) * PER_PX))
        y = int(floor(0.5 * (points[1, i] + points[1, j]) * PER_PX))
        cell = sector(along + 0.5 * FULL_TURN / ROTATIONS, ROTATIONS)
        pose[e] = (cell * PLACES + (x & (PLACES - 1))) * PLACES + (y & (PLACES - 1))
    return 0


def sector(angle, count):
    """Return in which of so many equal parts of a turn an angle lies."""
    share = angle / FULL_TURN
    share -= floor(share)
    bin_ = int(share * count)
    return bin_ if bin_ < count else count - 1


if not cython.compiled:
    from fpmatch.indexing import numpy_forms

    describe_edges = numpy_forms.describe_edges

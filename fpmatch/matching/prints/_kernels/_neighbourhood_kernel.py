# mypy: ignore-errors
"""Kernel: the nearest neighbours of minutiae, in their frames.

`NeighbourhoodWriter` finds each minutia's nearest neighbours in its first two rings, where they lie
in its own frame, and their weights by the shape-preserving weights of its ring (eq. 4).
"""

import cython
import numpy as np
from cython.cimports.fpmatch.pointset.paper._one_ring_kernel import (
    shape_preserving_weights,
)
from cython.cimports.libc.math import rint, sqrt

from fpmatch.matching.constants import prints

EDGES = 6  # a minutia, in the mean, at most: a triangulation has half as many
LEAST_WEIGHT = cython.declare(cython.double, prints.LEAST_WEIGHT)


@cython.final
@cython.cclass
class NeighbourhoodWriter:
    """Write the neighbourhoods of prints, one after the other, into flat arrays.

    `points` (4, M) are the minutiae of all prints, each of `capacity` minutiae at most; the others
    are as `Neighbourhoods` has them, `near` and `frame` filled with zeros.
    """

    def __init__(self, points, parameters, capacity, count, near, frame) -> None:
        p, entries = parameters, 2 * EDGES * capacity
        self.points, self.count, self.near, self.frame = points, count, near, frame
        self.size, self.second_weight = p.neighbours, p.second_ring_weight
        self.tolerance, self.growth = p.tolerance_px, p.tolerance_per_px
        self.joined, self.joined_start = (
            np.empty(entries, np.int32),
            np.empty(capacity + 2, np.int32),
        )
        self.met = np.empty(capacity, np.int32)
        self.ring_weight, self.distance = np.empty(entries), np.empty(p.neighbours)
        self.weight = np.full(capacity, p.second_ring_weight)

    @cython.locals(begin=cython.Py_ssize_t, k=cython.Py_ssize_t)
    def write(self, first, edge, start, ring, interior):
        """Write the neighbourhoods of the print whose first minutia is `first`, by its mesh.

        `edge` (E, 2) are the joined minutiae, counted from the first; there are at most six edges a
        minutia. The ring of minutia i is ``ring[start[i]:start[i + 1]]``, and closed where
        `interior`. Of two neighbours equally near the one of the smaller index comes first.
        """
        n = start.shape[0] - 1
        self._join(n, edge)
        for i in range(n):
            self.met[i] = -1
        for i in range(n):
            listed = self._list_nearest(first, i)
            self.count[first + i] = listed
            begin = end = start[i]
            if interior[i]:
                end = start[i + 1]
                if not shape_preserving_weights(
                    self.points[0, first : first + n],
                    self.points[1, first : first + n],
                    ring,
                    begin,
                    end,
                    self.points[0, first + i],
                    self.points[1, first + i],
                    self.ring_weight,
                ):
                    end = begin  # rounding has put the minutia outside its ring
            for e in range(begin, end):
                self.weight[ring[e]] += (
                    (1.0 - self.second_weight) * self.ring_weight[e] * (end - begin)
                )
            total: cython.double = 0.0
            for k in range(listed):
                total += self.weight[self.near[first + i, k]]
            total = listed / (total if total > LEAST_WEIGHT else LEAST_WEIGHT)
            self._write_frame(first, i, listed, total)
            for e in range(begin, end):
                self.weight[ring[e]] = self.second_weight
        return 0

    def _join(self, n, edge):
        """List the minutiae joined with each of n minutiae."""
        for i in range(n + 2):
            self.joined_start[i] = 0
        # `joined_start` runs one ahead while they are filled in
        for e in range(edge.shape[0]):
            self.joined_start[edge[e, 0] + 2] += 1
            self.joined_start[edge[e, 1] + 2] += 1
        for i in range(n):
            self.joined_start[i + 2] += self.joined_start[i + 1]
        for e in range(edge.shape[0]):
            for k in range(2):
                j = edge[e, k]
                self.joined[self.joined_start[j + 1]] = edge[e, 1 - k]
                self.joined_start[j + 1] += 1
        return 0

    @cython.locals(e=cython.Py_ssize_t)
    def _list_nearest(self, first, i):
        """List the nearest minutiae of the first two rings of minutia i; return their number."""
        x, y, size = self.points[0, first + i], self.points[1, first + i], self.size
        listed: cython.int = 0
        self.met[i] = i
        for e in range(self.joined_start[i], self.joined_start[i + 1]):
            via = self.joined[e]
            # the minutia in the first ring, then those joined with it
            for f in range(self.joined_start[via] - 1, self.joined_start[via + 1]):
                j = via if f < self.joined_start[via] else self.joined[f]
                if self.met[j] == i:
                    continue
                self.met[j] = i
                dx = self.points[0, first + j] - x
                dy = self.points[1, first + j] - y
                squared = dx * dx + dy * dy
                if listed < size:
                    listed += 1
                elif not self._before(first + i, size - 1, squared, j):
                    continue
                k = listed - 1
                while k > 0 and self._before(first + i, k - 1, squared, j):
                    self.distance[k] = self.distance[k - 1]
                    self.near[first + i, k] = self.near[first + i, k - 1]
                    k -= 1
                self.distance[k] = squared
                self.near[first + i, k] = j
        return listed

    def _before(self, row, k, squared, j):
        """Return whether minutia j, so far off, comes before entry k of a row of `near`."""
        return squared < self.distance[k] or (squared == self.distance[k] and j < self.near[row, k])

    def _write_frame(self, first, i, listed, scale):
        """Write the listed neighbours of minutia i in its frame; `scale` is that of weights.

        The square roots of weights are rounded to hundredths, so that a byte keeps each of them.
        """
        row = first + i
        x, y, c, s = (
            self.points[0, row],
            self.points[1, row],
            self.points[2, row],
            self.points[3, row],
        )
        for k in range(listed):
            j: cython.Py_ssize_t = self.near[row, k]
            dx = self.points[0, first + j] - x
            dy = self.points[1, first + j] - y
            tolerance = self.tolerance + self.growth * sqrt(self.distance[k])
            self.frame[row, 0, k] = c * dx + s * dy
            self.frame[row, 1, k] = c * dy - s * dx
            dx = self.points[2, first + j]
            dy = self.points[3, first + j]
            self.frame[row, 2, k] = c * dx + s * dy
            self.frame[row, 3, k] = c * dy - s * dx
            self.frame[row, 4, k] = 1.0 / (tolerance * tolerance)
            root: cython.float = sqrt(self.weight[j] * scale)
            self.frame[row, 5, k] = min(rint(100.0 * root), 255.0) / 100.0
        return 0

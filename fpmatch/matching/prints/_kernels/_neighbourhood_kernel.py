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

from fpmatch.matching import constants

EDGES = 6  # a minutia, in the mean, at most: a triangulation has half as many
LEAST_WEIGHT = cython.declare(cython.double, constants.LEAST_WEIGHT)


@cython.final
@cython.cclass
class NeighbourhoodWriter:
    """Write the neighbourhoods of a print of the minutiae `points` (4, N).

    `count` and `frame` are as `Neighbourhoods` has them; `frame` is filled with zeros. ``near[i]``
    are the neighbours of minutia i.
    """

    def __init__(self, points, parameters, count, frame) -> None:
        p, n = parameters, len(count)
        self.x, self.y, self.c, self.s = points
        self.count, self.frame = count, frame
        self.near = np.zeros((n, p.neighbours), np.int32)
        self.size, self.second_weight = p.neighbours, p.second_ring_weight
        self.tolerance, self.growth = p.tolerance_px, p.tolerance_per_px
        self.joined = np.empty(2 * EDGES * n, np.int32)
        self.joined_start, self.met = np.empty(n + 2, np.int32), np.full(n, -1, np.int32)
        self.ring_weight, self.distance = np.empty(2 * EDGES * n), np.empty(p.neighbours)
        self.weight = np.full(n, p.second_ring_weight)

    @cython.locals(begin=cython.Py_ssize_t, k=cython.Py_ssize_t)
    def write(self, edge, start, ring, interior):
        """Write the neighbourhoods by the mesh of the print.

        `edge` (E, 2) are the joined minutiae; there are at most six edges a minutia. The ring of
        minutia i is ``ring[start[i]:start[i + 1]]``, and closed where `interior`. Of two neighbours
        equally near the one of the smaller index comes first.
        """
        self._join(edge)
        for i in range(self.count.shape[0]):
            listed = self._list_nearest(i)
            self.count[i] = listed
            begin = end = start[i]
            if interior[i]:
                end = start[i + 1]
                if not shape_preserving_weights(
                    self.x, self.y, ring, begin, end, self.x[i], self.y[i], self.ring_weight
                ):
                    end = begin  # rounding has put the minutia outside its ring
            for e in range(begin, end):
                more = (1.0 - self.second_weight) * self.ring_weight[e] * (end - begin)
                self.weight[ring[e]] += more
            total: cython.double = 0.0
            for k in range(listed):
                total += self.weight[self.near[i, k]]
            self._write_frame(i, listed, listed / max(total, LEAST_WEIGHT))
            for e in range(begin, end):
                self.weight[ring[e]] = self.second_weight
        return 0

    def _join(self, edge):
        """List the minutiae joined with each minutia."""
        n = self.count.shape[0]
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
    def _list_nearest(self, i):
        """List the nearest minutiae of the first two rings of minutia i; return their number."""
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
                dx = self.x[j] - self.x[i]
                dy = self.y[j] - self.y[i]
                squared = dx * dx + dy * dy
                if listed < self.size:
                    listed += 1
                elif not self._before(i, listed - 1, squared, j):
                    continue
                k = listed - 1
                while k > 0 and self._before(i, k - 1, squared, j):
                    self.distance[k] = self.distance[k - 1]
                    self.near[i, k] = self.near[i, k - 1]
                    k -= 1
                self.distance[k] = squared
                self.near[i, k] = j
        return listed

    def _before(self, i, k, squared, j):
        """Return whether minutia j, so far off, comes before entry k of the neighbours of i."""
        return squared < self.distance[k] or (squared == self.distance[k] and j < self.near[i, k])

    def _write_frame(self, i, listed, scale):
        """Write the listed neighbours of minutia i in its frame; `scale` is that of weights.

        The square roots of weights are rounded to hundredths, so that a byte keeps each of them.
        """
        c, s = self.c[i], self.s[i]
        for k in range(listed):
            j: cython.Py_ssize_t = self.near[i, k]
            dx = self.x[j] - self.x[i]
            dy = self.y[j] - self.y[i]
            tolerance = self.tolerance + self.growth * sqrt(self.distance[k])
            self.frame[i, 0, k] = c * dx + s * dy
            self.frame[i, 1, k] = c * dy - s * dx
            self.frame[i, 2, k] = c * self.c[j] + s * self.s[j]
            self.frame[i, 3, k] = c * self.s[j] - s * self.c[j]
            self.frame[i, 4, k] = 1.0 / (tolerance * tolerance)
            root: cython.float = sqrt(self.weight[j] * scale)
            self.frame[i, 5, k] = min(rint(100.0 * root), 255.0) / 100.0
        return 0

# mypy: ignore-errors
"""Kernel: the Delaunay mesh of the paired minutiae, and what it predicts and measures.

The paired minutiae of print A are triangulated; their partners are the same mesh in print B, so
that the one-rings of a pair have equal degree in both prints, as the paper requires. Eight frame
points around the print, mapped by the similarity transform of the pairs, close the rings on the
hull.

A minutia of A is the sum of the vertices of its ring by its shape-preserving weights (eq. 4); the
same sum of their partners predicts its place in B. The weights are invariant under affine maps.
A pair is measured on its ring by the agreement of the chord-length places of the vertices on the
unit circle (eq. 3) in A and in B, and by the distance of its partner from the prediction. Minutiae
are columns of an array (4, N) as in `_alignment_kernel`.

Source: Choi, Lee, Lee, "Point pattern matching algorithm using unit-circle parametrization",
sections 3.1 and 3.2; incremental insertion: A. Bowyer, "Computing Dirichlet tessellations", The
Computer Journal 24(2), 1981.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.pointset.paper._one_ring_kernel import (
    shape_preserving_weights,
)
from cython.cimports.libc.math import cos, exp, sin, sqrt

from fpmatch.matching.constants import *

FULL_TURN = cython.declare(cython.double, 6.283185307179586)
LEAST_TRIANGLE = cython.declare(cython.double, 1e-9)  # px²: of a triangle


@cython.final
@cython.cclass
class PairMesh:
    """The mesh of the pairs of two prints, of which A has up to `size_a` minutiae.

    After `predict`, ``predicted[:, i]`` is the predicted minutia i of A in B, and ``nearest[i]``
    its distance from the nearest other pair in its ring. If the pairs were measured, `places` and
    `weights` are the sums over them of the agreement, 0 to 1, of the places on the circle and with
    the prediction, `full` of the share of the weights on pairs rather than frame points.
    """

    def __init__(self, parameters, size_a) -> None:
        p = parameters
        room = size_a + FRAME
        self.ax, self.ay, self.bx, self.by = np.zeros((4, room))
        self.owner = np.zeros(room, np.int32)
        self.vertex_of = np.full(max(size_a, 1), -1, np.int32)
        self.corner = np.zeros((2 * room, 3), np.int32)
        self.circle = np.zeros((2 * room, 3))
        self.fan_start = np.zeros(room + 2, np.int32)
        self.fan_from, self.fan_to, self.side_from, self.side_to = np.zeros((4, 6 * room), np.int32)
        self.following, self.ring = np.zeros((2, room), np.int32)
        self.weight, self.place, self.other_place = np.zeros((3, room))
        self.inside = np.zeros(2 * room, np.int32)
        self.side = np.zeros(6 * room, np.int64)
        self.predicted = np.zeros((4, size_a))
        self.nearest = np.zeros(size_a)
        self.frame_margin_px = p.frame_margin_px
        self.place_scale = -0.5 / (p.place_tolerance * p.place_tolerance)
        self.residual_px = p.residual_px
        self.residual_per_px = p.residual_per_px

    @cython.locals(i=cython.Py_ssize_t)
    def build(self, a, size_a, b, partner, c, s, x, y):
        """Triangulate the pairs; return the number of triangles.

        ``partner[i]`` is the partner of minutia i of A in B, or -1; (c, s, x, y) maps the frame
        points. A minutia that coincides with an earlier one is not a vertex.
        """
        low_x = high_x = a[0, 0] if size_a > 0 else 0.0
        low_y = high_y = a[1, 0] if size_a > 0 else 0.0
        for i in range(size_a):
            low_x = a[0, i] if a[0, i] < low_x else low_x
            low_y = a[1, i] if a[1, i] < low_y else low_y
            high_x = a[0, i] if a[0, i] > high_x else high_x
            high_y = a[1, i] if a[1, i] > high_y else high_y
        middle_x = 0.5 * (low_x + high_x)
        middle_y = 0.5 * (low_y + high_y)
        low_x = high_x - middle_x
        low_y = high_y - middle_y
        radius = sqrt(low_x * low_x + low_y * low_y) + self.frame_margin_px
        for v in range(FRAME):
            self.ax[v] = middle_x + radius * cos(v * FULL_TURN / FRAME)
            self.ay[v] = middle_y + radius * sin(v * FULL_TURN / FRAME)
            self.bx[v] = x + c * self.ax[v] - s * self.ay[v]
            self.by[v] = y + s * self.ax[v] + c * self.ay[v]
            self.owner[v] = -1
        self.vertices = FRAME
        self.triangles = FRAME - 2
        for k in range(FRAME - 2):
            self._put_triangle(k, 0, k + 1, k + 2)
        for i in range(size_a):
            self.vertex_of[i] = -1
            if partner[i] >= 0:
                v = self.vertices
                self.ax[v], self.ay[v] = a[0, i], a[1, i]
                self.bx[v], self.by[v] = b[0, partner[i]], b[1, partner[i]]
                if self._insert(v):
                    self.owner[v] = i
                    self.vertex_of[i] = v
                    self.vertices += 1
        self._sort_fans()
        return self.triangles

    @cython.locals(k=cython.Py_ssize_t)
    def _insert(self, v):
        """Insert a vertex into the triangulation; return whether it was inserted."""
        x, y = self.ax[v], self.ay[v]
        removed = self._cavity(x, y)
        # more triangles than a ring needs enclose a vertex, which would be lost
        if self.ring_size < 3 or removed != self.ring_size - 2:
            return False
        for k in range(self.ring_size):
            following = k + 1 if k + 1 < self.ring_size else 0
            p: cython.Py_ssize_t = self.ring[k]
            q: cython.Py_ssize_t = self.ring[following]
            area = (self.ax[p] - x) * (self.ay[q] - y) - (self.ay[p] - y) * (self.ax[q] - x)
            if area <= LEAST_TRIANGLE:
                return False
        # the new triangles take the places of those removed first, then new ones
        for k in range(self.ring_size):
            following = k + 1 if k + 1 < self.ring_size else 0
            if k < removed:
                t = self.inside[k]
            else:
                t = self.triangles
                self.triangles += 1
            self._put_triangle(t, v, self.ring[k], self.ring[following])
        return True

    def _put_triangle(self, t, p, q, r):
        """Write triangle t, counter-clockwise, and its circumcircle."""
        ux = self.ax[q] - self.ax[p]
        uy = self.ay[q] - self.ay[p]
        vx = self.ax[r] - self.ax[p]
        vy = self.ay[r] - self.ay[p]
        area = 2.0 * (ux * vy - uy * vx)
        u2 = ux * ux + uy * uy
        v2 = vx * vx + vy * vy
        x = (vy * u2 - uy * v2) / area
        y = (ux * v2 - vx * u2) / area
        self.corner[t, 0] = p
        self.corner[t, 1] = q
        self.corner[t, 2] = r
        self.circle[t, 0] = self.ax[p] + x
        self.circle[t, 1] = self.ay[p] + y
        self.circle[t, 2] = x * x + y * y - ROUNDING
        return 0

    @cython.locals(found=cython.int)
    def _cavity(self, x, y):
        """List the triangles whose circumcircle contains a point; return their number.

        `ring` becomes the boundary of their union, counter-clockwise: the ring of the point if it
        were inserted; its size is 0 where the boundary is not one closed polygon.
        """
        found = kept = 0
        self.ring_size = 0
        for t in range(self.triangles):
            dx = self.circle[t, 0] - x
            dy = self.circle[t, 1] - y
            # always written, but counted only if inside: avoids branch misprediction
            self.inside[found] = t
            found += dx * dx + dy * dy < self.circle[t, 2]
        # a side of two of the triangles occurs in both directions, and is removed the second time
        for k in range(found):
            t = self.inside[k]
            for e in range(3):
                u: cython.longlong = self.corner[t, e]
                v: cython.longlong = self.corner[t, e + 1 if e < 2 else 0]
                back = (v << 24) | u
                f = kept - 1
                while f >= 0 and self.side[f] != back:
                    f -= 1
                if f < 0:
                    self.side[kept] = (u << 24) | v
                    kept += 1
                else:
                    kept -= 1
                    self.side[f] = self.side[kept]
        for k in range(kept):
            self.side_from[k] = self.side[k] >> 24
            self.side_to[k] = self.side[k] & 0xFFFFFF
        self._chain(self.side_from, self.side_to, 0, kept)
        return found

    def _chain(self, start, end, first, last):
        """Chain the sides from ``start[k]`` to ``end[k]`` into `ring`."""
        self.ring_size = 0
        if last - first < 3 or last - first > self.vertices:
            return 0
        for k in range(first, last):
            self.following[end[k]] = -1
        for k in range(first, last):
            self.following[start[k]] = end[k]
        v = start[first]
        for k in range(last - first):
            self.ring[k] = v
            v = self.following[v]
            if v < 0 or (v == start[first] and k + 1 < last - first):
                return 0
        if v == start[first]:
            self.ring_size = last - first
        return self.ring_size

    def _sort_fans(self):
        """Sort the sides opposite to each vertex, from `fan_from` to `fan_to`, by the vertex."""
        # the starts run one ahead while the sides are sorted, two while they are counted
        for v in range(self.vertices + 2):
            self.fan_start[v] = 0
        for t in range(self.triangles):
            for e in range(3):
                self.fan_start[self.corner[t, e] + 2] += 1
        for v in range(self.vertices):
            self.fan_start[v + 2] += self.fan_start[v + 1]
        for t in range(self.triangles):
            for e in range(3):
                v = self.corner[t, e]
                at: cython.Py_ssize_t = self.fan_start[v + 1]
                self.fan_from[at] = self.corner[t, e + 1 if e < 2 else 0]
                self.fan_to[at] = self.corner[t, e + 2 if e < 1 else e - 1]
                self.fan_start[v + 1] += 1
        return self.fan_start[self.vertices]

    def predict(self, a, size_a, b, partner, c, s, x, y, measured):
        """Predict the places of all minutiae of A in B; return how many the mesh predicts.

        A minutia without a ring is mapped by the transform (c, s, x, y). If `measured`, the pairs
        of the mesh are measured.
        """
        scale = sqrt(c * c + s * s)
        found: cython.int = 0
        scale = 1.0 / scale if scale > 0.0 else 0.0
        self.places = self.weights = self.full = 0.0
        for i in range(size_a):
            v: cython.Py_ssize_t = self.vertex_of[i]
            if v < 0:
                self._cavity(a[0, i], a[1, i])
            else:
                self._chain(self.fan_from, self.fan_to, self.fan_start[v], self.fan_start[v + 1])
            if self._predict_one(a, i):
                found += 1
                if measured and v >= 0:
                    self._measure_one(a, i, b, partner[i])
                continue
            self.predicted[0, i] = x + c * a[0, i] - s * a[1, i]
            self.predicted[1, i] = y + s * a[0, i] + c * a[1, i]
            self.predicted[2, i] = scale * (c * a[2, i] - s * a[3, i])
            self.predicted[3, i] = scale * (s * a[2, i] + c * a[3, i])
            self.nearest[i] = FAR_AWAY
        return found

    @cython.locals(k=cython.Py_ssize_t)
    def _predict_one(self, a, i):
        """Predict minutia i of A by the current ring; return whether the ring encloses it.

        Its direction is rotated by the weighted least-squares rotation of the ring's spokes.
        """
        px, py = a[0, i], a[1, i]
        x = y = c = s = 0.0
        nearest2 = FAR_AWAY * FAR_AWAY
        if self.ring_size < 3 or not shape_preserving_weights(
            self.ax, self.ay, self.ring, 0, self.ring_size, px, py, self.weight
        ):
            return False
        for k in range(self.ring_size):
            v: cython.Py_ssize_t = self.ring[k]
            x += self.weight[k] * self.bx[v]
            y += self.weight[k] * self.by[v]
        for k in range(self.ring_size):
            v = self.ring[k]
            ax = self.ax[v] - px
            ay = self.ay[v] - py
            bx = self.bx[v] - x
            by = self.by[v] - y
            length2 = ax * ax + ay * ay
            if v >= FRAME and length2 < nearest2:
                nearest2 = length2
            weight = self.weight[k] / (length2 + NEAR2)
            c += weight * (ax * bx + ay * by)
            s += weight * (ax * by - ay * bx)
        length2 = sqrt(c * c + s * s)
        if not length2 > 0.0:
            return False
        c /= length2
        s /= length2
        self.predicted[0, i] = x
        self.predicted[1, i] = y
        self.predicted[2, i] = c * a[2, i] - s * a[3, i]
        self.predicted[3, i] = s * a[2, i] + c * a[3, i]
        self.nearest[i] = sqrt(nearest2)
        return True

    @cython.locals(k=cython.Py_ssize_t)
    def _measure_one(self, a, i, b, j):
        """Measure the pair of minutia i of A and j of B on the ring that predicted it."""
        radius = on_pairs = 0.0
        for k in range(self.ring_size):
            v: cython.Py_ssize_t = self.ring[k]
            dx = self.ax[v] - a[0, i]
            dy = self.ay[v] - a[1, i]
            radius += self.weight[k] * sqrt(dx * dx + dy * dy)
            if v >= FRAME:
                on_pairs += self.weight[k]
        dx = self.predicted[0, i] - b[0, j]
        dy = self.predicted[1, i] - b[1, j]
        dx = sqrt(dx * dx + dy * dy) / (self.residual_px + self.residual_per_px * radius)
        self.full += on_pairs
        self.weights += exp(-0.5 * dx * dx)
        # of the places on the two unit circles, of which the mean rotation is removed
        around_a = around_b = mean = square = 0.0
        for k in range(self.ring_size):
            following = k + 1 if k + 1 < self.ring_size else 0
            v = self.ring[k]
            u: cython.Py_ssize_t = self.ring[following]
            self.place[k] = around_a
            self.other_place[k] = around_b
            dx = self.ax[u] - self.ax[v]
            dy = self.ay[u] - self.ay[v]
            around_a += sqrt(dx * dx + dy * dy)
            dx = self.bx[u] - self.bx[v]
            dy = self.by[u] - self.by[v]
            around_b += sqrt(dx * dx + dy * dy)
        if not (around_a > 0.0 and around_b > 0.0):
            return 0
        for k in range(self.ring_size):
            self.place[k] = self.place[k] / around_a - self.other_place[k] / around_b
            mean += self.place[k]
        mean /= self.ring_size
        for k in range(self.ring_size):
            dx = FULL_TURN * (self.place[k] - mean)
            square += dx * dx
        self.places += exp(self.place_scale * square / self.ring_size)
        return self.ring_size

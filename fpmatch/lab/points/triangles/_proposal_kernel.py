# mypy: ignore-errors
"""Kernel: the shapes of triangles, and the transforms that similar triangles propose.

A triangle's shape is the complex number z of its apex where its longest side is mapped to 0..1:
invariant under similarity transforms. Every triangle of P, in a given order, is compared with the
triangles of Q of nearly its shape. Each such pair proposes a transform, which is tested on one
neighbour after the other; each neighbour with a partner is added to the fit, so that most false
proposals are rejected after a few. Interpreted, it runs as it stands.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.libc.math import exp, sqrt
else:
    from math import exp, sqrt

REJECT = cython.declare(cython.double, -2.5)  # log-likelihood ratio under which a test ends,
ACCEPT = cython.declare(cython.double, 14.0)  # or over which it ends,
ACCEPT_SMALL = cython.declare(cython.double, 4.0)  # enough where P has no more neighbours to test
TEST_LENGTH = cython.declare(cython.Py_ssize_t, 60)  # neighbours tested, at most
MOST_GROWN = cython.declare(cython.Py_ssize_t, 2_000)  # neighbours that determine any transform


@cython.locals(a=cython.int, b=cython.int)
def describe_triangles(
    point, triangle, near_tie, shortest, outliers, corner, shape, side, negative_information,
):  # fmt: skip
    """Describe each triangle by each side that is longest to within `near_tie`; return how many.

    ``corner[k]`` receives the ends of that side and the apex, counter-clockwise, ``shape[:, k]``
    the real and imaginary part of z, ``side[k]`` the side's length. Sides under `shortest` are
    left out. ``-negative_information[k]`` is the value of a match of the triangle, which grows
    with its size, times the probability exp(-outliers·circle) that no outlier, of which there are
    `outliers` to a unit of area, lies in its circumcircle and splits it. Where
    ``negative_information`` has no entries, it is not computed.
    """
    pi = 3.141592653589793
    k = 0
    for i in range(triangle.shape[0]):
        longest2 = 0.0
        for r in range(3):
            a, b = triangle[i, r], triangle[i, (r + 1) % 3]
            dx, dy = point[0, b] - point[0, a], point[1, b] - point[1, a]
            longest2 = max(longest2, dx * dx + dy * dy)
        for r in range(3):
            a, b, c = triangle[i, r], triangle[i, (r + 1) % 3], triangle[i, (r + 2) % 3]
            dx, dy = point[0, b] - point[0, a], point[1, b] - point[1, a]
            side2 = dx * dx + dy * dy
            least2 = max(longest2 * near_tie * near_tie, shortest * shortest)
            if side2 <= 0.0 or side2 < least2:
                continue
            ex, ey = point[0, c] - point[0, a], point[1, c] - point[1, a]
            zx, zy = (ex * dx + ey * dy) / side2, (ey * dx - ex * dy) / side2
            if zy <= 0.0:
                continue
            corner[k, 0], corner[k, 1], corner[k, 2] = a, b, c
            shape[0, k], shape[1, k], side[k] = zx, zy, sqrt(side2)
            if negative_information.shape[0] > 0:
                radius2 = side2 * (zx * zx + zy * zy) * ((zx - 1.0) * (zx - 1.0) + zy * zy)
                negative_information[k] = -side2 * exp(-outliers * pi * radius2 / (4.0 * zy * zy))
            k += 1
    return k


class Proposals:
    """Transforms of P that map one of its triangles onto a similar one of Q, and their test.

    ``corner_p`` and ``shape_p`` describe the triangles of P, which are taken in an ``order``;
    ``corner_q`` and ``side_q`` those of Q, whose ``shapes`` are a grid. Shapes are similar within
    `shape_tolerance` over the side of Q's, at most `widest_shape`. ``grid`` holds the points `q`. A
    neighbour's partner is sought within reach², and up to `widest` times that by the uncertainty of
    the fit; ``gain`` is the log-likelihood ratio of one that has a partner, in steps of that
    factor, `miss` that of one without. ``visits`` (1,) counts what is visited: the measure of work.

    After a proposal that passes, ``move`` is its fit (s·cos θ, s·sin θ, tx, ty). ``tried`` counts
    the pairs of triangles tested.
    """

    def __init__(
        self, p, corner_p, shape_p, order, ring_start, ring, q, grid, corner_q, side_q, shapes,
        shape_tolerance, widest_shape, reach2, widest, gain, miss, tried, visits,
    ):  # fmt: skip
        self.p, self.corner_p, self.shape_p, self.order = p, corner_p, shape_p, order
        self.ring_start, self.ring = ring_start, ring
        self.q, self.grid = q, grid
        self.corner_q, self.side_q, self.shapes = corner_q, side_q, shapes
        self.shape_tolerance, self.widest_shape = shape_tolerance, widest_shape
        self.reach2, self.most_wider, self.gain, self.miss = reach2, widest - 1.0, gain, miss
        self.steps = (gain.shape[0] - 1) / self.most_wider
        self.accept_small = min(ACCEPT_SMALL, 0.5 * (p.shape[1] - 3) * gain[0])
        self.tried, self.visits = tried, visits
        self.seen = np.zeros(p.shape[1], np.intc)
        self.neighbours = np.empty(min(p.shape[1], MOST_GROWN), np.intc)
        self.fit, self.move = np.empty(8), np.empty(4)
        self.place = self.met = self.k = self.stamp = 0
        self.ratio = 0.0

    @cython.locals(row=cython.Py_ssize_t, e=cython.Py_ssize_t, count=cython.Py_ssize_t)
    def proceed(self, max_tried, max_visits):
        """Search on; return whether a proposal has passed.

        The search ends with `max_tried` pairs of triangles, or `max_visits`.
        """
        for o in range(self.place, self.order.shape[0]):
            self.k = self.order[o]
            if self.visits[0] >= max_visits:
                return False
            zx, zy = self.shape_p[0, self.k], self.shape_p[1, self.k]
            count = -1
            met = 0
            left, top, right, bottom = self.shapes.around(zx, zy, self.widest_shape)
            for row in range(top, bottom):
                begin = self.shapes.start[row * self.shapes.columns + left]
                stop = self.shapes.start[row * self.shapes.columns + right]
                self.visits[0] += (stop - begin) // 8  # most are not similar
                for e in range(begin, stop):
                    met += 1
                    if o == self.place and met <= self.met:
                        continue
                    dx, dy = self.shapes.x[e] - zx, self.shapes.y[e] - zy
                    j: cython.Py_ssize_t = self.shapes.order[e]
                    limit = self.shape_tolerance / self.side_q[j]
                    if dx * dx + dy * dy > limit * limit:
                        continue
                    if self.tried >= max_tried or self.visits[0] >= max_visits:
                        return False
                    self.tried += 1
                    if count < 0:
                        count = self._find_neighbours(min(TEST_LENGTH, self.neighbours.shape[0]))
                    if self._passes(j, count):
                        self.place, self.met = o, met
                        return True
        self.place, self.met = self.order.shape[0], 0
        return False

    def _passes(self, j, count):
        """Return whether the transform onto triangle j of Q passes its test; then fit it widely."""
        self._fit_corners(j)
        self._grow(count, REJECT, ACCEPT)
        if self.ratio < ACCEPT and (self.ratio < self.accept_small or count >= TEST_LENGTH):
            return False
        self._fit_corners(j)
        self._grow(self._find_neighbours(self.neighbours.shape[0]), -1e300, 1e300)
        fit, move = self.fit, self.move
        move[0], move[1] = fit[6] / fit[5], fit[7] / fit[5]
        move[2] = fit[3] - move[0] * fit[1] + move[1] * fit[2]
        move[3] = fit[4] - move[1] * fit[1] - move[0] * fit[2]
        return True

    @cython.locals(e=cython.Py_ssize_t)
    def _find_neighbours(self, limit):
        """Write the points around the triangle breadth-first, without corners; return how many."""
        self.stamp += 1
        for at in range(3):
            self.seen[self.corner_p[self.k, at]] = self.stamp
        n = 0
        at = -3  # the corners come first
        while at < n < limit:
            i = self.corner_p[self.k, at + 3] if at < 0 else self.neighbours[at]
            at += 1
            for e in range(self.ring_start[i], self.ring_start[i + 1]):
                if n == limit:
                    break
                j = self.ring[e]
                if self.seen[j] != self.stamp:
                    self.seen[j] = self.stamp
                    self.neighbours[n] = j
                    n += 1
        return n

    @cython.locals(i=cython.int, j=cython.int)
    def _fit_corners(self, t):
        """Start the fit with the corners of triangle k of P and t of Q.

        A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σ|p|², Σp·q, Σp×q.
        """
        pmx = pmy = qmx = qmy = 0.0
        for r in range(3):
            i, j = self.corner_p[self.k, r], self.corner_q[t, r]
            pmx += self.p[0, i] / 3.0
            pmy += self.p[1, i] / 3.0
            qmx += self.q[0, j] / 3.0
            qmy += self.q[1, j] / 3.0
        spread = cosine = sine = 0.0
        for r in range(3):
            i, j = self.corner_p[self.k, r], self.corner_q[t, r]
            px, py = self.p[0, i] - pmx, self.p[1, i] - pmy
            qx, qy = self.q[0, j] - qmx, self.q[1, j] - qmy
            spread += px * px + py * py
            cosine += px * qx + py * qy
            sine += px * qy - py * qx
        self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4] = 3.0, pmx, pmy, qmx, qmy
        self.fit[5], self.fit[6], self.fit[7] = spread, cosine, sine

    def _grow(self, count, reject, accept):
        """Add one neighbour after the other to the fit where it has a partner; set the ratio."""
        size, pmx, pmy, qmx, qmy = self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4]
        spread, cosine, sine = self.fit[5], self.fit[6], self.fit[7]
        one_of, one_spread = 1.0 / size, 1.0 / spread
        wc, ws = cosine * one_spread, sine * one_spread
        self.ratio = 0.0
        for n in range(count):
            i: cython.int = self.neighbours[n]
            px, py = self.p[0, i] - pmx, self.p[1, i] - pmy
            x, y = qmx + wc * px - ws * py, qmy + ws * px + wc * py
            at = self._partner(x, y, one_of + (px * px + py * py) * one_spread)
            if at < 0:
                if self.ratio < reject:
                    break
                continue
            # means and centred sums with one pair more
            shrink = size / (size + 1.0)
            size += 1.0
            one_of = 1.0 / size
            qx, qy = self.grid.x[at] - qmx, self.grid.y[at] - qmy
            pmx += px * one_of
            pmy += py * one_of
            qmx += qx * one_of
            qmy += qy * one_of
            spread += shrink * (px * px + py * py)
            cosine += shrink * (px * qx + py * qy)
            sine += shrink * (px * qy - py * qx)
            one_spread = 1.0 / spread
            wc, ws = cosine * one_spread, sine * one_spread
            if self.ratio > accept:
                break
        self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4] = size, pmx, pmy, qmx, qmy
        self.fit[5], self.fit[6], self.fit[7] = spread, cosine, sine

    def _partner(self, x, y, variance):
        """Return the point of Q nearest to a neighbour moved to (x, y), or -1; add to the ratio.

        `variance` is that of the fit there, in tolerances: the reach is as much wider, in area.
        """
        self.visits[0] += 1
        if x < self.grid.x0 or y < self.grid.y0 or x > self.grid.x1 or y > self.grid.y1:
            return -1
        wider = min(variance, self.most_wider)
        at = self.grid.nearest(x, y, self.reach2 * (1.0 + wider))
        if at < 0:
            self.ratio += self.miss
        else:
            step: cython.Py_ssize_t = int(wider * self.steps)
            self.ratio += self.gain[step]
        return at

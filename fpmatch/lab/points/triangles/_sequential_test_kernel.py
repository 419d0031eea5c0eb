# mypy: ignore-errors
"""Kernel: test the transforms that pairs of triangles propose, one neighbour after the other.

Each neighbour with a partner is added to the fit of the transform, so that most false proposals are
rejected after a few neighbours. Which transform is fitted is for the classes that extend
`SequentialTest`.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import expm1, log
else:
    from math import expm1, log

COMPILED = cython.compiled

WIDEST = cython.declare(cython.double, 6.0)  # most by which a fit's uncertainty widens reach²
MIN_CHANCE = cython.declare(cython.double, 1e-300)  # of a hit, where the tolerance is tiny


class SequentialTest:
    """The test of transforms of P that map one of its triangles onto one of Q.

    A test ends where its log-likelihood ratio is under `reject` or over `accept`; where P has fewer
    neighbours than `test_length`, `accept_small` suffices. ``gain`` and `miss` come from
    `hit_log_likelihoods`. ``fit`` receives the fit of a proposal that passes, to as many points as
    ``neighbours`` holds. ``grid`` holds the points `q`; ``seen`` starts with zeros. `visits` (1,)
    counts the neighbours tested, and what else the search visits: the measure of work done.
    """

    def __init__(
        self, p, corner, ring_start, ring, q, grid, reach2, gain, miss, reject, accept,
        accept_small, test_length, seen, neighbours, fit, visits,
    ):  # fmt: skip
        self.p, self.corner, self.ring_start, self.ring = p, corner, ring_start, ring
        self.q, self.grid = q, grid
        self.reach2, self.gain, self.miss = reach2, gain, miss
        self.reject, self.accept, self.accept_small = reject, accept, accept_small
        self.test_length = min(test_length, neighbours.shape[0])
        self.seen, self.neighbours, self.fit = seen, neighbours, fit
        self.visits = visits
        self.steps = (gain.shape[0] - 1) / (WIDEST - 1.0)
        self.k = self.stamp = 0
        self.count = -1
        self.ratio = 0.0

    def begin(self, k):
        """Test what is proposed for triangle `k` of P from now on."""
        self.k = k
        self.count = -1

    def passes(self, a, b, c):
        """Return whether the transform onto the triangle `a`, `b`, `c` of Q passes its test."""
        if self.count < 0:
            self.count = self._find_neighbours(self.test_length)
        self._fit_corners(a, b, c)
        self._grow(self.count, self.reject, self.accept)
        if self.ratio < self.accept and (
            self.ratio < self.accept_small or self.count >= self.test_length
        ):
            return False
        self._fit_corners(a, b, c)
        self._grow(self._find_neighbours(self.neighbours.shape[0]), -1e300, 1e300)
        return True

    @cython.locals(e=cython.Py_ssize_t)
    def _find_neighbours(self, limit):
        """Write the points around the triangle breadth-first, without corners; return how many."""
        self.stamp += 1
        for at in range(3):
            self.seen[self.corner[self.k, at]] = self.stamp
        n = 0
        at = -3  # the corners come first
        while at < n < limit:
            i = self.corner[self.k, at + 3] if at < 0 else self.neighbours[at]
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

    def _partner(self, x, y, variance):
        """Return the point of Q nearest to a neighbour moved to (x, y), or -1; add to the ratio.

        It is sought within √reach2, and farther by the fit's own uncertainty there. The
        log-likelihood ratio of a true transform to a false one is the sum of ``gain``, by the area
        of that reach, for each neighbour with a partner, and of `miss` for the others in the grid.
        """
        self.visits[0] += 1
        if x < self.grid.x0 or y < self.grid.y0 or x > self.grid.x1 or y > self.grid.y1:
            return -1
        wider = min(variance, WIDEST - 1.0)
        at = self.grid.nearest(x, y, self.reach2 * (1.0 + wider))
        if at < 0:
            self.ratio += self.miss
        else:
            step: cython.Py_ssize_t = int(wider * self.steps)
            self.ratio += self.gain[step]
        return at

    def _fit_corners(self, a, b, c):
        """Start the fit with the corners of two triangles."""

    def _grow(self, count, reject, accept):
        """Add one neighbour after the other to the fit where it has a partner; set the ratio."""


def hit_log_likelihoods(expected, share, gain):
    """Write the log-likelihood ratios of a neighbour with a partner; return that of one without.

    A true transform brings `share` of the neighbours onto points of Q, a false one does so by
    chance. ``gain`` has steps for reaches of 1 to `WIDEST` times reach2 in area; `expected` points
    of Q are within reach2.
    """
    steps: cython.double = gain.shape[0] - 1
    for k in range(gain.shape[0]):
        chance = max(-expm1(-expected * (1.0 + (WIDEST - 1.0) * k / steps)), MIN_CHANCE)
        gain[k] = log((share + (1.0 - share) * chance) / chance)
    return log(1.0 - share)

# mypy: ignore-errors
"""Kernel: search by the ridges for transforms that align two prints.

Each pair of minutiae, one of each print, fixes a transform: the one that maps position and
direction of the first to those of the second. The pairs under which the ridge orientation of the
smaller print agrees best with that of the larger are kept; of these, those under which the ridges
themselves correlate best, each with a transform of its own.

A small print has few minutiae with incomplete neighbourhoods, so that local matches are not
reliable: all pairs are tried. Of larger prints only the candidates of the relaxed local matches
are tried.
"""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from fpmatch.matching import constants
from fpmatch.matching.prints._kernels._template_view_kernel import FLOW_OF_CODE

SAMPLES = cython.declare(cython.int, constants.FLOW_SAMPLES)
ROOM = cython.declare(cython.int, 128)  # pairs whose ridges are compared, at most
FOUND = cython.declare(cython.int, 8)  # pairs found, at most


@cython.final
@cython.cclass
class RidgeSearch:
    """The pairs of minutiae under which the ridges of one print agree with those of another.

    After a search, the pairs are ``(first[k], second[k])`` of print A and print B, the best first.
    """

    def __init__(self, parameters) -> None:
        p = parameters
        self.flow_c, self.flow_s = FLOW_OF_CODE
        self.sample, self.sample_flow = np.zeros((2, 2, SAMPLES))
        self.best_flow = np.zeros(ROOM)
        self.best_own, self.best_other = np.zeros((2, ROOM), np.int32)
        self.first, self.second = np.zeros((2, FOUND), np.int32)
        self.value, self.transform = np.zeros(ROOM), np.zeros((ROOM, 4))
        self.ridge_trials, self.ridge_starts = p.ridge_trials, p.ridge_starts
        self.ridge_candidates = p.ridge_candidates
        self.least_common, self.least_flow = p.least_common, p.least_flow
        self.candidate_flow, self.candidate_value = p.candidate_flow, p.candidate_value
        self.usual_correlation = p.usual_correlation
        self.apart_px, self.apart_cosine = p.apart_px, p.apart_cosine

    @cython.locals(k=cython.Py_ssize_t)
    def search(self, a, b, relaxation, every, correlator):
        """Find pairs of two prints that show their ridges; return their number.

        They are several of all pairs, if `every`, else at most one of the relaxed candidates.
        """
        first, second, count = relaxation.first, relaxation.second, relaxation.count
        self.room, self.most = self.ridge_candidates, 1
        self.min_flow, self.min_value = self.candidate_flow, self.candidate_value
        if every:
            self.room, self.most = self.ridge_trials, self.ridge_starts
            self.min_flow, self.min_value = self.least_flow, 0.0
        if a.inside * (a.step * a.step) <= b.inside * (b.step * b.step):
            return self._search(a, first, b, second, count, every, correlator)
        found = self._search(b, second, a, first, count, every, correlator)
        for k in range(found):
            self.first[k], self.second[k] = self.second[k], self.first[k]
        return found

    @cython.locals(k=cython.Py_ssize_t, i=cython.int, j=cython.int)
    def _search(self, small, own, large, other, candidates, every, correlator):
        """Find pairs of a smaller and a larger print, of all or of lists of candidates."""
        self.count = 0
        self._take_samples(small)
        if every:
            for i in range(small.size):
                for j in range(large.size):
                    self._offer(small, i, large, j)
        else:
            for k in range(candidates):
                self._offer(small, own[k], large, other[k])
        for k in range(self.count):
            self._fit_pair(small, self.best_own[k], large, self.best_other[k])
            self.transform[k, 0], self.transform[k, 1] = self.c, self.s
            self.transform[k, 2], self.transform[k, 3] = self.x, self.y
            correlator.compare(small, large, None, self.c, self.s, self.x, self.y)
            surplus = correlator.correlation - self.usual_correlation
            self.value[k] = surplus * sqrt(correlator.cells)
        return self._choose()

    def _take_samples(self, small):
        """Take cells of the smaller print, spread evenly over its rows; return their number."""
        passed = 0
        cells: cython.Py_ssize_t = small.inside
        self.samples = 0
        self.middle_x = self.middle_y = 0.0
        for row in range(small.rows):
            for column in range(small.columns):
                code: cython.int = small.cell[row, column]
                if code == 0:
                    continue
                # of every stretch of cells / SAMPLES cells the first
                if passed * SAMPLES >= self.samples * cells and self.samples < SAMPLES:
                    x = (small.first_column + column + 0.5) * small.step
                    y = -(small.first_row + row + 0.5) * small.step
                    self.sample[0, self.samples] = x
                    self.sample[1, self.samples] = y
                    self.sample_flow[0, self.samples] = self.flow_c[code]
                    self.sample_flow[1, self.samples] = self.flow_s[code]
                    self.middle_x += x
                    self.middle_y += y
                    self.samples += 1
                passed += 1
        if self.samples > 0:
            self.middle_x /= self.samples
            self.middle_y /= self.samples
        return self.samples

    def _fit_pair(self, small, i, large, j):
        """Take the transform that maps minutia i of the smaller print to j of the larger."""
        ac, as_ = small.points[2, i], small.points[3, i]
        bc, bs = large.points[2, j], large.points[3, j]
        self.c = ac * bc + as_ * bs
        self.s = ac * bs - as_ * bc
        self.x = large.points[0, j] - self.c * small.points[0, i] + self.s * small.points[1, i]
        self.y = large.points[1, j] - self.s * small.points[0, i] - self.c * small.points[1, i]
        return 0

    @cython.locals(k=cython.Py_ssize_t)
    def _flow_agreement(self, large):
        """Return how well the orientation agrees under the current transform, -1 to 1.

        -2 where the prints have too little in common.
        """
        common: cython.int = 0
        turn_c = self.c * self.c - self.s * self.s
        turn_s = 2.0 * self.c * self.s
        total = 0.0
        for k in range(self.samples):
            x = self.c * self.sample[0, k] - self.s * self.sample[1, k] + self.x
            y = self.s * self.sample[0, k] + self.c * self.sample[1, k] + self.y
            code: cython.int = large.code_at(x, y)
            if code == 0:
                continue
            common += 1
            x = turn_c * self.sample_flow[0, k] - turn_s * self.sample_flow[1, k]
            y = turn_s * self.sample_flow[0, k] + turn_c * self.sample_flow[1, k]
            total += x * self.flow_c[code] + y * self.flow_s[code]
        if common < self.least_common * self.samples:
            return -2.0
        return total / common if common > 0 else -2.0

    def _offer(self, small, i, large, j):
        """Keep a pair if the orientation agrees better than under others; return how many are."""
        self._fit_pair(small, i, large, j)
        flow = self._flow_agreement(large)
        if flow < self.min_flow:
            return self.count
        if self.count == self.room and flow <= self.best_flow[self.count - 1]:
            return self.count
        if self.count < self.room:
            self.count += 1
        k = self.count - 1
        while k > 0 and self.best_flow[k - 1] < flow:
            self.best_flow[k] = self.best_flow[k - 1]
            self.best_own[k], self.best_other[k] = self.best_own[k - 1], self.best_other[k - 1]
            k -= 1
        self.best_flow[k] = flow
        self.best_own[k], self.best_other[k] = i, j
        return self.count

    @cython.locals(k=cython.Py_ssize_t)
    def _choose(self):
        """Choose the pairs of the greatest values, none near a better one; return their number."""
        found: cython.int = 0
        while found < self.most:
            best: cython.Py_ssize_t = 0
            for k in range(1, self.count):
                best = k if self.value[k] > self.value[best] else best
            if self.count == 0 or self.value[best] <= self.min_value:
                break
            self.first[found], self.second[found] = self.best_own[best], self.best_other[best]
            found += 1
            self.c, self.s = self.transform[best, 0], self.transform[best, 1]
            self.x, self.y = self.transform[best, 2], self.transform[best, 3]
            for k in range(self.count):
                self.value[k] = self.min_value if self._is_near(k) else self.value[k]
        return found

    def _is_near(self, k):
        """Return whether the current transform is about that of pair k."""
        dc = self.c - self.transform[k, 0]
        ds = self.s - self.transform[k, 1]
        dx = dc * self.middle_x - ds * self.middle_y + self.x - self.transform[k, 2]
        dy = ds * self.middle_x + dc * self.middle_y + self.y - self.transform[k, 3]
        cosine = self.c * self.transform[k, 0] + self.s * self.transform[k, 1]
        return dx * dx + dy * dy < self.apart_px * self.apart_px and cosine > self.apart_cosine

# mypy: ignore-errors
"""Kernel: align two prints: pair their minutiae, one to one, and fit the transform of the pairs.

The pairs come from hypotheses of the relaxed local matches (`_relaxation_kernel`). The Delaunay
mesh of the pairs (`_pair_mesh_kernel`) predicts where every minutia of print A lies in print B;
minutiae are paired again near their predictions. In a few such rounds the mesh grows and loses the
pairs that do not fit their rings. One similarity transform (eq. 1) is fitted to the pairs.

Minutiae are columns of an array (4, N): x, y in pixels at 500 dpi with y pointing up, and the unit
vector (c, s) of the direction. A transform is (c, s, x, y): the scale times cosine and sine of the
rotation, and the shift.
"""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from fpmatch.matching.constants import *
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel import PairMesh
from fpmatch.matching.pipeline._kernels._relaxation_kernel import Relaxation

MOST_PROPOSED = cython.declare(cython.int, 8)  # hypotheses besides those of the local matches
MARGIN = cython.declare(cython.double, 0.01)  # px, more than the rounding error of a distance


@cython.final
@cython.cclass
class Aligner:
    """Align print A, of up to `size_a` minutiae, with print B, of up to `size_b`.

    ``predicted[:, i]`` is where minutia i of A lies in B, as the mesh of pairs predicts it;
    ``partner[i]`` its partner in B, or -1, and ``weight[i]`` how well it fits. These are the
    current pairs, of which `pairs` is the number. `keep` stores them in row h of the arrays
    ``kept_...``, in which hypothesis k of the local matches is row k, and others have the rows
    after these. ``sorted[:, e]`` is minutia ``order[e]`` of B, by ascending x.
    """

    def __init__(self, size_a, size_b, parameters) -> None:
        p = parameters
        self.relaxation = Relaxation(p, size_a, size_b)
        self.mesh = PairMesh(p, size_a)
        self.predicted = self.mesh.predicted
        self.sorted = np.empty((4, size_b))
        self.order, self.rival = np.empty((2, size_b), np.int32)
        self.rival_weight = np.empty(size_b)
        self.reach, self.weight = np.zeros((2, size_a))
        self.partner, self.former = np.full((2, size_a), -1, np.int32)
        self.hypotheses = p.hypotheses
        self.rows = p.hypotheses + MOST_PROPOSED
        self.kept_pairs = np.zeros(self.rows, np.int32)
        self.kept_partner = np.empty((self.rows, size_a), np.int32)
        self.kept_weight = np.empty((self.rows, size_a))
        self.kept_predicted = np.empty((self.rows, 4, size_a))
        self.kept_transform = np.empty((self.rows, 4))
        self.coarse_rounds, self.rounds = p.coarse_rounds, p.rounds
        self.min_cosine = p.min_cosine
        self.reach_px, self.reach_per_px = p.reach_px, p.reach_per_px
        self.reach_limit_px = p.reach_limit_px

    def load(self, a, size_a, b, size_b):
        """Take the first `size_a` columns of `a` as print A, and likewise print B."""
        self.a, self.b = a, b
        self.size_a, self.size_b = size_a, size_b
        for j in range(size_b):
            e: cython.Py_ssize_t = j
            while e > 0 and b[0, self.order[e - 1]] > b[0, j]:
                self.order[e] = self.order[e - 1]
                e -= 1
            self.order[e] = j
        for e in range(size_b):
            for row in range(4):
                self.sorted[row, e] = b[row, self.order[e]]
        return 0

    def start_hypothesis(self, k):
        """Grow hypothesis k, the next one, coarsely; keep it in row k; return its number of pairs.

        It is 0 where there are no more hypotheses, and where nothing is paired.
        """
        self.measured_row = -1
        self.pairs = self.relaxation.hypothesis(self.size_a, k == 0, self.partner, self.weight)
        if self.pairs > 0:
            self._first_fit()
            self.grow(self.coarse_rounds, False)
            self.measured_row = k
            self.relaxation.explain(self.partner)
        return self.keep(k)

    def refine(self, k):
        """Grow the hypothesis kept in row k to the end; keep it there; return its pairs."""
        measured: cython.bint = self.measured_row == k
        self.measured_row = -1
        for i in range(self.size_a):
            self.partner[i] = self.kept_partner[k, i]
            self.weight[i] = self.kept_weight[k, i]
        self.c, self.s = self.kept_transform[k, 0], self.kept_transform[k, 1]
        self.x, self.y = self.kept_transform[k, 2], self.kept_transform[k, 3]
        self.pairs = self.kept_pairs[k]
        if self.pairs > 0:
            if not measured:
                self.predict(True)
            self.grow(self.rounds - self.coarse_rounds, True)
        return self.keep(k)

    def start_from(self, i, j, row):
        """Grow from minutia i of A and j of B alone, to the end; keep it; return its pairs."""
        self.measured_row = -1
        for k in range(self.size_a):
            self.partner[k] = -1
            self.weight[k] = 0.0
        self.partner[i] = j
        self.weight[i] = 1.0
        self.pairs = 1
        self._first_fit()
        self.grow(self.rounds, False)
        return self.keep(row)

    def keep(self, row):
        """Keep the current pairs in a row; return their number."""
        self.kept_pairs[row] = self.pairs
        self.kept_transform[row, 0], self.kept_transform[row, 1] = self.c, self.s
        self.kept_transform[row, 2], self.kept_transform[row, 3] = self.x, self.y
        for i in range(self.size_a):
            self.kept_partner[row, i] = self.partner[i]
            self.kept_weight[row, i] = self.weight[i]
        for axis in range(4):
            for i in range(self.size_a):
                self.kept_predicted[row, axis, i] = self.predicted[axis, i]
        return self.pairs

    def _first_fit(self):
        """Fit the transform to the current pairs, of which there is one at least."""
        i: cython.Py_ssize_t = 0
        while self.partner[i] < 0:
            i += 1
        j: cython.Py_ssize_t = self.partner[i]
        a, b = self.a, self.b
        # of a single pair: its own directions and positions
        self.c = a[2, i] * b[2, j] + a[3, i] * b[3, j]
        self.s = a[2, i] * b[3, j] - a[3, i] * b[2, j]
        self.x = b[0, j] - self.c * a[0, i] + self.s * a[1, i]
        self.y = b[1, j] - self.s * a[0, i] - self.c * a[1, i]
        return self._fit()

    def grow(self, rounds, measured):
        """Predict by the mesh of the pairs and pair again, in turn; then measure the mesh.

        It ends early where no pair changes. Where already `measured`, the current mesh is that of
        the current pairs, and so are its measures. Return the number of pairs. The reach of a
        minutia grows with its distance from the nearest other pair.
        """
        for r in range(rounds):
            if not measured:
                self.predict(r > 0)
                measured = r > 0
            for i in range(self.size_a):
                reach = self.reach_px + self.reach_per_px * self.mesh.nearest[i]
                self.reach[i] = reach if reach < self.reach_limit_px else self.reach_limit_px
                self.former[i] = self.partner[i]
            self._pair()
            changed: cython.bint = False
            for i in range(self.size_a):
                changed = changed or self.former[i] != self.partner[i]
            if measured and not changed:
                return self.pairs
            self._fit()
            measured = False
            if self.pairs == 0:
                return 0
        if not measured:
            self.predict(True)
        return self.pairs

    def predict(self, measured):
        """Build the mesh of the current pairs, and predict all minutiae by it."""
        c, s, x, y = self.c, self.s, self.x, self.y
        self.mesh.build(self.a, self.size_a, self.b, self.partner, c, s, x, y)
        return self.mesh.predict(self.a, self.size_a, self.b, self.partner, c, s, x, y, measured)

    def _pair(self):
        """Pair minutiae of A and of B that are each other's best partner.

        `predicted` has the positions of those of A. A pair at distance d within the reach r of its
        minutia, with directions at cosine t, weighs
        ``(1 - d²/2r²)·(t - min_cosine)/(1 - min_cosine)``; of equals the first is taken. Return the
        number of pairs.
        """
        self.pairs = 0
        least = self.min_cosine
        scale = 1.0 / (1.0 - least)
        for j in range(self.size_b):
            self.rival[j] = -1
            self.rival_weight[j] = 0.0
        for i in range(self.size_a):
            self.partner[i] = -1
            self.weight[i] = 0.0
            x, y = self.predicted[0, i], self.predicted[1, i]
            best = 0.0
            best_j = -1
            r2 = self.reach[i] * self.reach[i]
            left, right = x - self.reach[i] - MARGIN, x + self.reach[i] + MARGIN
            e: cython.Py_ssize_t = 0
            end: cython.Py_ssize_t = self.size_b
            while e < end:
                middle = (e + end) // 2
                if self.sorted[0, middle] < left:
                    e = middle + 1
                else:
                    end = middle
            while e < self.size_b and self.sorted[0, e] <= right:
                j = self.order[e]
                dx = self.sorted[0, e] - x
                dy = self.sorted[1, e] - y
                d2: cython.double = dx * dx + dy * dy
                cosine: cython.double = self.predicted[2, i] * self.sorted[2, e]
                cosine += self.predicted[3, i] * self.sorted[3, e]
                e += 1
                # one test of both: one of them nearly always fails, each of them often does not
                if not ((d2 < r2) & (cosine > least)):
                    continue
                value: cython.double = (1.0 - 0.5 * d2 / r2) * (cosine - least) * scale
                if value > best or (value == best and j < best_j):
                    best = value
                    best_j = j
                if value > self.rival_weight[j]:
                    self.rival_weight[j] = value
                    self.rival[j] = i
            if best_j >= 0:
                self.partner[i] = best_j
                self.weight[i] = best
        for i in range(self.size_a):
            if self.partner[i] >= 0:
                if self.rival[self.partner[i]] == i:
                    self.pairs += 1
                else:
                    self.partner[i] = -1
                    self.weight[i] = 0.0
        return self.pairs

    @cython.locals(i=cython.Py_ssize_t)
    def _fit(self):
        """Fit the similarity transform to the pairs by weighted least squares; return their number.

        Directions count as positions do at 30 px from the middle, so that few pairs, or pairs close
        together, determine the rotation. The scale is held within 6 % of one. With fewer than two
        pairs the transform stays as it is.
        """
        n = self.pairs
        total = amx = amy = bmx = bmy = 0.0
        cosine = sine = spread = turn_c = turn_s = 0.0
        for i in range(self.size_a):
            j: cython.Py_ssize_t = self.partner[i]
            if j < 0:
                continue
            w = self.weight[i]
            total += w
            amx += w * self.a[0, i]
            amy += w * self.a[1, i]
            bmx += w * self.b[0, j]
            bmy += w * self.b[1, j]
        if n < 2 or total <= 0.0:
            return n
        amx /= total
        amy /= total
        bmx /= total
        bmy /= total
        for i in range(self.size_a):
            j = self.partner[i]
            if j < 0:
                continue
            w = self.weight[i]
            dx = self.a[0, i] - amx
            dy = self.a[1, i] - amy
            ex = self.b[0, j] - bmx
            ey = self.b[1, j] - bmy
            cosine += w * (dx * ex + dy * ey)
            sine += w * (dx * ey - dy * ex)
            spread += w * (dx * dx + dy * dy)
            turn_c += w * (self.a[2, i] * self.b[2, j] + self.a[3, i] * self.b[3, j])
            turn_s += w * (self.a[2, i] * self.b[3, j] - self.a[3, i] * self.b[2, j])
        scale = sqrt(cosine * cosine + sine * sine) / spread if spread > 0.0 else 1.0
        if n < FEWEST_FOR_SCALE:
            scale = 1.0
        scale = min(max(scale, LEAST_SCALE), MOST_SCALE)
        cosine += DIRECTION_ARM2 * turn_c
        sine += DIRECTION_ARM2 * turn_s
        length = sqrt(cosine * cosine + sine * sine)
        if length <= 0.0:
            return n
        self.c = scale * cosine / length
        self.s = scale * sine / length
        self.x = bmx - self.c * amx + self.s * amy
        self.y = bmy - self.s * amx - self.c * amy
        return n

# mypy: ignore-errors
"""Kernel: propose similarity transforms from similar triangles.

Every triangle of P, in a given order, is compared with the triangles of Q of nearly its shape; each
such pair proposes a transform, which is tested sequentially.

A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σ|p|², Σp·q, Σp×q.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.lab.points.triangles._sequential_test_kernel import SequentialTest
else:
    from fpmatch.lab.points.triangles._sequential_test_kernel import SequentialTest

COMPILED = cython.compiled


@cython.locals(row=cython.Py_ssize_t, e=cython.Py_ssize_t)
def propose(
    test, order, shape_p, corner_q, side_q, shapes, shape_tolerance, widest, max_proposals,
    max_visits, state,
):  # fmt: skip
    """Continue the search until a proposal passes its test; return whether one did.

    ``shapes`` holds the shapes of Q's triangles. ``state`` holds the position in ``order``, the
    number of triangles of Q compared there, and that of pairs of triangles tested, of which there
    are `max_proposals` at most; the search ends with `max_visits` of the test, too.
    """
    for o in range(state[0], order.shape[0]):
        k = order[o]
        if test.visits[0] >= max_visits:
            return False
        zx, zy = shape_p[0, k], shape_p[1, k]
        test.begin(k)
        met = 0
        left, top, right, bottom = shapes.around(zx, zy, widest)
        for row in range(top, bottom):
            begin = shapes.start[row * shapes.columns + left]
            end = shapes.start[row * shapes.columns + right]
            test.visits[0] += (end - begin) // 8  # most are not similar
            for e in range(begin, end):
                met += 1
                if o == state[0] and met <= state[1]:
                    continue
                dx, dy = shapes.x[e] - zx, shapes.y[e] - zy
                j: cython.Py_ssize_t = shapes.order[e]
                limit = shape_tolerance / side_q[j]
                if dx * dx + dy * dy > limit * limit:
                    continue
                if state[2] >= max_proposals or test.visits[0] >= max_visits:
                    return False
                state[2] += 1
                if test.passes(corner_q[j, 0], corner_q[j, 1], corner_q[j, 2]):
                    state[0], state[1] = o, met
                    return True
    return False


class SimilarityTest(SequentialTest):
    """The test of similarity transforms."""

    @cython.locals(i=cython.int, j=cython.int)
    def _fit_corners(self, a, b, c):
        pmx = pmy = qmx = qmy = 0.0
        for r in range(3):
            i, j = self.corner[self.k, r], a if r == 0 else b if r == 1 else c
            pmx += self.p[0, i] / 3.0
            pmy += self.p[1, i] / 3.0
            qmx += self.q[0, j] / 3.0
            qmy += self.q[1, j] / 3.0
        spread = cosine = sine = 0.0
        for r in range(3):
            i, j = self.corner[self.k, r], a if r == 0 else b if r == 1 else c
            px, py = self.p[0, i] - pmx, self.p[1, i] - pmy
            qx, qy = self.q[0, j] - qmx, self.q[1, j] - qmy
            spread += px * px + py * py
            cosine += px * qx + py * qy
            sine += px * qy - py * qx
        self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4] = 3.0, pmx, pmy, qmx, qmy
        self.fit[5], self.fit[6], self.fit[7] = spread, cosine, sine

    def _grow(self, count, reject, accept):
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

# mypy: ignore-errors
"""Kernel: propose affine transforms from pairs of local triangles.

Any triangle can be mapped onto any other, so every triangle of P, in a given order, is compared
with every triangle of Q in its three rotations. The linear part of each map, between frames in
which both sets are equally wide in all directions, must not stretch one direction much more than
another; what remains is tested sequentially.

A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σpp (xx, xy, yy) and Σqp (xx,
xy, yx, yy). A move is the matrix [A | t], row by row. Q is a grid; indices of its points are in the
order of its cells.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.lab.points.triangles._sequential_test_kernel import SequentialTest
else:
    from fpmatch.lab.points.triangles._sequential_test_kernel import SequentialTest

COMPILED = cython.compiled


def propose(
    test, p, order, corner_p, corner_q, wide_q, max_anisotropy, least_area, most_area,
    max_proposals, max_visits, state,
):  # fmt: skip
    """Continue the search until a proposal passes its test; return whether one did.

    ``p`` is equally wide in all directions, as is ``wide_q``, the points of Q in another frame than
    that of the test; between these two a map stretches no direction more than `max_anisotropy`
    times another, and areas by `least_area` to `most_area`. ``state`` holds the position in
    ``order``, the number of triangles of Q compared there, and that of those tested in all, of
    which there are `max_proposals` at most; the search ends with `max_visits` of the test, too.
    """
    limit = max_anisotropy + 1.0 / max_anisotropy
    many = 3 * corner_q.shape[0]
    for o in range(state[0], order.shape[0]):
        k = order[o]
        if test.visits[0] >= max_visits:
            return False
        test.visits[0] += many // 16  # most are rejected at a glance
        a, b, c = corner_p[k, 0], corner_p[k, 1], corner_p[k, 2]
        ux, uy = p[0, b] - p[0, a], p[1, b] - p[1, a]
        vx, vy = p[0, c] - p[0, a], p[1, c] - p[1, a]
        area = ux * vy - uy * vx
        test.begin(k)
        for met in range(state[1] if o == state[0] else 0, many):
            j, r = met // 3, met % 3
            a, b, c = corner_q[j, r], corner_q[j, (r + 1) % 3], corner_q[j, (r + 2) % 3]
            fx, fy = wide_q[0, b] - wide_q[0, a], wide_q[1, b] - wide_q[1, a]
            gx, gy = wide_q[0, c] - wide_q[0, a], wide_q[1, c] - wide_q[1, a]
            area_q = fx * gy - fy * gx
            if area_q < least_area * area or area_q > most_area * area:
                continue
            # the linear map times the area, and its determinant times the area squared
            xx, xy = fx * vy - gx * uy, gx * ux - fx * vx
            yx, yy = fy * vy - gy * uy, gy * ux - fy * vx
            if xx * xx + xy * xy + yx * yx + yy * yy > limit * area * area_q:
                continue
            if state[2] >= max_proposals or test.visits[0] >= max_visits:
                return False
            state[2] += 1
            if test.passes(a, b, c):
                state[0], state[1] = o, met + 1
                return True
    return False


class AffineTest(SequentialTest):
    """The test of affine transforms."""

    @cython.locals(i=cython.int, j=cython.int, k=cython.int)
    def _fit_corners(self, a, b, c):
        i, j, k = self.corner[self.k, 0], self.corner[self.k, 1], self.corner[self.k, 2]
        pmx = (self.p[0, i] + self.p[0, j] + self.p[0, k]) / 3.0
        pmy = (self.p[1, i] + self.p[1, j] + self.p[1, k]) / 3.0
        qmx = (self.q[0, a] + self.q[0, b] + self.q[0, c]) / 3.0
        qmy = (self.q[1, a] + self.q[1, b] + self.q[1, c]) / 3.0
        sxx = sxy = syy = cxx = cxy = cyx = cyy = 0.0
        for r in range(3):
            i, j = self.corner[self.k, r], a if r == 0 else b if r == 1 else c
            px, py = self.p[0, i] - pmx, self.p[1, i] - pmy
            qx, qy = self.q[0, j] - qmx, self.q[1, j] - qmy
            sxx += px * px
            sxy += px * py
            syy += py * py
            cxx += qx * px
            cxy += qx * py
            cyx += qy * px
            cyy += qy * py
        self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4] = 3.0, pmx, pmy, qmx, qmy
        self.fit[5], self.fit[6], self.fit[7] = sxx, sxy, syy
        self.fit[8], self.fit[9], self.fit[10], self.fit[11] = cxx, cxy, cyx, cyy

    def _grow(self, count, reject, accept):
        size, pmx, pmy, qmx, qmy = self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4]
        sxx, sxy, syy = self.fit[5], self.fit[6], self.fit[7]
        cxx, cxy, cyx, cyy = self.fit[8], self.fit[9], self.fit[10], self.fit[11]
        one_of, one_det = 1.0 / size, 1.0 / (sxx * syy - sxy * sxy)
        self.ratio = 0.0
        for n in range(count):
            i: cython.int = self.neighbours[n]
            px, py = self.p[0, i] - pmx, self.p[1, i] - pmy
            # the offset in the frame where Σpp is the identity's: A·p = C·w
            wx, wy = (syy * px - sxy * py) * one_det, (sxx * py - sxy * px) * one_det
            x, y = qmx + cxx * wx + cxy * wy, qmy + cyx * wx + cyy * wy
            at = self._partner(x, y, one_of + px * wx + py * wy)
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
            px, py = px * shrink, py * shrink
            sxx += px * px / shrink
            sxy += px * py / shrink
            syy += py * py / shrink
            cxx += qx * px
            cxy += qx * py
            cyx += qy * px
            cyy += qy * py
            one_det = 1.0 / (sxx * syy - sxy * sxy)
            if self.ratio > accept:
                break
        self.fit[0], self.fit[1], self.fit[2], self.fit[3], self.fit[4] = size, pmx, pmy, qmx, qmy
        self.fit[5], self.fit[6], self.fit[7] = sxx, sxy, syy
        self.fit[8], self.fit[9], self.fit[10], self.fit[11] = cxx, cxy, cyx, cyy


def move_of(fit, move):
    """Write the move of a fit."""
    det = fit[5] * fit[7] - fit[6] * fit[6]
    for r in range(2):
        cx, cy = fit[8 + 2 * r], fit[9 + 2 * r]
        move[3 * r] = (cx * fit[7] - cy * fit[6]) / det
        move[3 * r + 1] = (cy * fit[5] - cx * fit[6]) / det
        move[3 * r + 2] = fit[3 + r] - move[3 * r] * fit[1] - move[3 * r + 1] * fit[2]

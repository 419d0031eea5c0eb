# mypy: ignore-errors
"""Kernel: Delaunay triangulation of distinct points by divide and conquer.

After G. Leach, "Improving worst-case optimal Delaunay triangulation algorithms" (4th Canadian
Conference on Computational Geometry, 1992), which is L. Guibas and J. Stolfi's divide and conquer
(ACM Transactions on Graphics 4, 1985) without the dual: the points are sorted once, edges come from
a pool and carry four links, and of two candidates above an edge the nearer one is that with the
smaller cotangent of the angle under which it sees the edge, which needs the same vectors as the
test on which side of the edge it lies.

Coordinates are whole numbers up to 2**52, so their differences are exact; a predicate is evaluated
in float64 where rounding cannot change its sign, and with Python's integers where it could.
"""

import cython
import numpy as np

COMPILED = cython.compiled

_WHOLE = cython.declare(cython.double, 2.0**52)  # whole numbers up to here add without error
_ROUNDING = cython.declare(cython.double, 2.0**-49)  # of a difference of cotangents, generously


def link_points(in_order: cython.double[:, ::1], distinct: cython.Py_ssize_t) -> object:
    """Return origin, after and before, shape (3, 6N + 2), of the triangulation of sorted points.

    The first `distinct` points of ``in_order`` (2, N), three at least and not all on one line, are
    triangulated. In the result ``before[0]`` is the end of the half-edges in use, of which those
    without an edge have the origin -1; ``after[1]`` is the hull's half-edge out of the first
    point, counter-clockwise. See `Subdivision`.
    """
    links = np.empty((3, 6 * in_order.shape[1] + 2), np.intc)
    mesh = Subdivision(in_order, links)
    mesh.triangulate(0, distinct)
    links[1, 1] = mesh.first[0]
    return links


@cython.final
@cython.cclass
class Subdivision:
    """The half-edges of a triangulation that is being built.

    An edge is two half-edges, h and h ^ 1, each the other's reverse: ``origin[h]`` is the point it
    leaves, ``after[h]`` and ``before[h]`` the next half-edges round that point, counter-clockwise
    and clockwise. Points are numbered in the order by x, then y. Half-edges 0 and 1 are no edge:
    ``after[0]`` is the first free edge (0: none), ``before[0]`` the first that was never used.
    """

    x: cython.double[::1]
    y: cython.double[::1]
    origin: cython.int[::1]
    after: cython.int[::1]
    before: cython.int[::1]
    first: cython.int[::1]  # hull's counter-clockwise half-edge out of a part's first point
    last: cython.int[::1]  # hull's clockwise half-edge out of a part's last point

    def __init__(self, in_order: cython.double[:, ::1], link: cython.int[:, ::1]) -> None:
        hull: cython.int[:, ::1] = np.empty((2, in_order.shape[1]), np.intc)
        self.x, self.y = in_order[0], in_order[1]
        self.origin, self.after, self.before = link[0], link[1], link[2]
        self.first, self.last = hull[0], hull[1]
        self.after[0], self.before[0] = 0, 2

    @cython.cfunc
    @cython.exceptval(check=False)
    def triangulate(self, low: cython.Py_ssize_t, high: cython.Py_ssize_t) -> cython.void:
        """Triangulate the points low..high (two at least), and write first[low], last[high - 1]."""
        cython.declare(middle=cython.Py_ssize_t, a=cython.int, b=cython.int, c=cython.int)
        if high - low > 3:
            middle = (low + high) // 2
            self.triangulate(low, middle)
            self.triangulate(middle, high)
            self._merge(low, middle, high)
            return
        a = self._new_edge(low, low + 1)
        self.first[low] = a
        self.last[high - 1] = a ^ 1
        if high - low == 2:
            return
        b = self._new_edge(low + 1, low + 2)
        self._insert_after(b, a ^ 1)
        self.last[high - 1] = b ^ 1
        turn: cython.int = self._turn(low, low + 1, low + 2)
        if turn != 0:
            c = self._join(b ^ 1, a)
            if turn < 0:
                self.first[low] = c ^ 1
                self.last[high - 1] = c

    @cython.cfunc
    @cython.exceptval(check=False)
    def _merge(
        self, low: cython.Py_ssize_t, middle: cython.Py_ssize_t, high: cython.Py_ssize_t
    ) -> cython.void:
        """Merge the triangulations of low..middle and middle..high, from the bottom up."""
        cython.declare(
            left=cython.int, right=cython.int, base=cython.int, a=cython.int, b=cython.int,
            p=cython.int, q=cython.int, order=cython.int,
        )  # fmt: skip
        left, right = self.last[middle - 1], self.first[middle]
        while True:  # down to the lower common tangent
            p, q = self.origin[left], self.origin[right]
            if self._turn(p, self.origin[left ^ 1], q) > 0:
                left = self.before[left ^ 1]
            elif self._turn(q, self.origin[right ^ 1], p) < 0:
                right = self.after[right ^ 1]
            else:
                break
        # the base runs from point q on the right to point p on the left
        base = self._join(right, left)
        if p == low:
            self.first[low] = base ^ 1
        if q == high - 1:
            self.last[high - 1] = base
        while True:
            left, a_cross, a_dot, a_size = self._candidate(self.after, self.after[base ^ 1], p, q)
            right, b_cross, b_dot, b_size = self._candidate(self.before, self.before[base], p, q)
            a, b = self.origin[left ^ 1], self.origin[right ^ 1]
            if b_cross > 0.0 and a_cross > 0.0:
                order = self._compare(b_cross, b_dot, b_size, a_cross, a_dot, a_size, p, q, b, a)
                if order == 0:
                    order = _tie(p, b, q, a)
            elif b_cross > 0.0:
                order = -1
            elif a_cross > 0.0:
                order = 1
            else:
                return
            if order < 0:
                base = self._join(right ^ 1, base ^ 1)
                q = b
            else:
                base = self._join(base, left ^ 1)
                p = a

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _candidate(
        self, onward: cython.int[::1], h: cython.int, p: cython.int, q: cython.int
    ) -> tuple[cython.int, cython.double, cython.double, cython.double]:
        """Return the half-edge of one side that may stay, and the `_sight` of its end.

        Candidates are h and those `onward` of it, `after` it on the left, `before` it on the right;
        those that the next one's end invalidates are deleted. There is one if the first number is
        above 0.
        """
        cython.declare(
            near=cython.int, far=cython.int, a=cython.int, c=cython.int, following=cython.int,
            order=cython.int,
        )  # fmt: skip
        near = self.origin[h]
        far = q if near == p else p
        a = self.origin[h ^ 1]
        cross, dot, size = self._sight(p, q, a)
        while cross > 0.0:
            following = onward[h]
            c = self.origin[following ^ 1]
            c_cross, c_dot, c_size = self._sight(p, q, c)
            if c_cross <= 0.0:
                break
            order = self._compare(c_cross, c_dot, c_size, cross, dot, size, p, q, c, a)
            if order == 0:
                order = _tie(far, c, near, a)
            if order > 0:
                break
            self._delete(h)
            h, a = following, c
            cross, dot, size = c_cross, c_dot, c_size
        return h, cross, dot, size

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _new_edge(self, start: cython.int, end: cython.int) -> cython.int:
        """Return a half-edge from `start` to `end`, linked with no other."""
        h: cython.int = self.after[0]
        if h:
            self.after[0] = self.after[h]
        else:
            h = self.before[0]
            self.before[0] = h + 2
        self.origin[h] = start
        self.after[h] = self.before[h] = h
        self.origin[h + 1] = end
        self.after[h + 1] = self.before[h + 1] = h + 1
        return h

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _insert_after(self, h: cython.int, g: cython.int) -> cython.void:
        """Link half-edge h, which is alone, as the next one counter-clockwise of g."""
        following: cython.int = self.after[g]
        self.after[h] = following
        self.before[h] = g
        self.before[following] = h
        self.after[g] = h

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _join(self, g: cython.int, h: cython.int) -> cython.int:
        """Return a new half-edge from the origin of g, just clockwise of it, to just after h."""
        e: cython.int = self._new_edge(self.origin[g], self.origin[h])
        self._insert_after(e, self.before[g])
        self._insert_after(e ^ 1, h)
        return e

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _delete(self, h: cython.int) -> cython.void:
        """Return the edge of half-edge h to the pool."""
        self.after[self.before[h]] = self.after[h]
        self.before[self.after[h]] = self.before[h]
        h ^= 1
        self.after[self.before[h]] = self.after[h]
        self.before[self.after[h]] = self.before[h]
        h &= ~1
        self.origin[h] = self.origin[h + 1] = -1
        self.after[h] = self.after[0]
        self.after[0] = h

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _turn(self, a: cython.int, b: cython.int, c: cython.int) -> cython.int:
        """Return 1 where c lies left of the line from a to b, -1 right of it, 0 on it; exact."""
        ux, uy = self.x[b] - self.x[a], self.y[b] - self.y[a]
        vx, vy = self.x[c] - self.x[a], self.y[c] - self.y[a]
        # rounding keeps order, so products that differ in float64 differ likewise
        one, other = ux * vy, uy * vx
        if one > other:
            return 1
        if one < other:
            return -1
        if abs(one) < _WHOLE:
            return 0
        one = _exact_cross(ux, uy, vx, vy)
        return 1 if one > 0.0 else -1 if one < 0.0 else 0

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _sight(
        self, p: cython.int, q: cython.int, c: cython.int
    ) -> tuple[cython.double, cython.double, cython.double]:
        """Return cross and dot product of the vectors from c to p and q, and a bound of both.

        The quotient dot/cross is the cotangent of the angle at c; the sign of the cross product is
        exact, positive where c lies above the line from p to q.
        """
        px, py = self.x[p] - self.x[c], self.y[p] - self.y[c]
        qx, qy = self.x[q] - self.x[c], self.y[q] - self.y[c]
        cross = px * qy - py * qx
        size = (abs(px) + abs(py)) * (abs(qx) + abs(qy))
        if cross == 0.0 and size >= _WHOLE:
            cross = _exact_cross(px, py, qx, qy)
        return cross, px * qx + py * qy, size

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _compare(
        self, c_cross: cython.double, c_dot: cython.double, c_size: cython.double,
        d_cross: cython.double, d_dot: cython.double, d_size: cython.double,
        p: cython.int, q: cython.int, c: cython.int, d: cython.int,
    ) -> cython.int:  # fmt: skip
        """Return the sign of the cotangent at c minus that at d; exact.

        It is negative where c is inside the circle through p, q and d.
        """
        difference = c_dot * d_cross - d_dot * c_cross
        size = c_size * d_size
        if abs(difference) <= _ROUNDING * size and size >= _WHOLE / 2.0:
            return self._compare_exactly(p, q, c, d)
        return 1 if difference > 0.0 else -1 if difference < 0.0 else 0

    @cython.cfunc
    @cython.exceptval(check=False)
    def _compare_exactly(
        self, p: cython.int, q: cython.int, c: cython.int, d: cython.int
    ) -> cython.int:
        """Do the same as `_compare` with Python's integers."""
        c_cross, c_dot = _exact_sight(
            self.x[p] - self.x[c], self.y[p] - self.y[c],
            self.x[q] - self.x[c], self.y[q] - self.y[c],
        )  # fmt: skip
        d_cross, d_dot = _exact_sight(
            self.x[p] - self.x[d], self.y[p] - self.y[d],
            self.x[q] - self.x[d], self.y[q] - self.y[d],
        )  # fmt: skip
        one, other = c_dot * d_cross, d_dot * c_cross
        return 1 if one > other else -1 if one < other else 0


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _tie(a: cython.int, b: cython.int, c: cython.int, d: cython.int) -> cython.int:
    """Return -1 where, of four points on a circle, a or b is the smallest, 1 where c or d is.

    The smallest keeps its diagonal, which is ab or cd.
    """
    return -1 if min(a, b) < min(c, d) else 1


@cython.cfunc
@cython.exceptval(check=False)
def _exact_cross(
    ux: cython.double, uy: cython.double, vx: cython.double, vy: cython.double
) -> cython.double:
    """Return the cross product of u and v, rounded once."""
    return float(_exact_sight(ux, uy, vx, vy)[0])


@cython.cfunc
def _exact_sight(
    ux: cython.double, uy: cython.double, vx: cython.double, vy: cython.double
) -> object:
    """Return cross and dot product of u and v, which are whole numbers."""
    ix, iy, jx, jy = int(ux), int(uy), int(vx), int(vy)
    return ix * jy - iy * jx, ix * jx + iy * jy

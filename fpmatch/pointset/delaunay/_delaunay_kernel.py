"""Kernel: Delaunay triangulation of distinct points by divide and conquer.

After G. Leach, "Improving worst-case optimal Delaunay triangulation algorithms" (4th Canadian
Conference on Computational Geometry, 1992), which is L. Guibas and J. Stolfi's divide and conquer
(ACM Transactions on Graphics 4, 1985) without the dual: the points are sorted once, edges are
taken from a pool and carry four links, and of two candidates above an edge the one that sees it
under the smaller cotangent is nearer, which shares the vectors of the test which side it lies on.

An edge is two half-edges, h and h ^ 1, each the other's reverse: ``origin[h]`` is the point it
leaves, ``after[h]`` and ``before[h]`` the next half-edges round that point, counter-clockwise and
clockwise. Points are numbered in the order by x, then y. Half-edges 0 and 1 are no edge:
``after[0]`` is the first free edge (0: none), ``before[0]`` the first that was never used.

Coordinates are whole numbers up to 2**52, so their differences are exact; of what is computed from
these, float64 decides where its error cannot matter, and Python's integers where it could.
Interpreted, the functions run as they stand and give the same.
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
    point, counter-clockwise.
    """
    n: cython.Py_ssize_t = in_order.shape[1]
    links = np.empty((3, 6 * n + 2), np.intc)
    link: cython.int[:, ::1] = links
    hull: cython.int[:, ::1] = np.empty((2, n), np.intc)
    link[1, 0] = 0
    link[2, 0] = 2
    _divide(in_order[0], in_order[1], link[0], link[1], link[2], hull[0], hull[1], 0, distinct)
    link[1, 1] = hull[0, 0]
    return links


@cython.cfunc
@cython.exceptval(check=False)
def _divide(
    x: cython.double[::1],
    y: cython.double[::1],
    origin: cython.int[::1],
    after: cython.int[::1],
    before: cython.int[::1],
    first: cython.int[::1],
    last: cython.int[::1],
    low: cython.Py_ssize_t,
    high: cython.Py_ssize_t,
) -> cython.void:
    """Triangulate the points low..high (two at least).

    ``first[low]`` receives the hull's counter-clockwise half-edge out of the first point,
    ``last[high - 1]`` its clockwise half-edge out of the last.
    """
    if high - low > 3:
        middle: cython.Py_ssize_t = (low + high) // 2
        _divide(x, y, origin, after, before, first, last, low, middle)
        _divide(x, y, origin, after, before, first, last, middle, high)
        _merge(x, y, origin, after, before, first, last, low, middle, high)
        return
    a: cython.int = _new_edge(origin, after, before, low, low + 1)
    first[low] = a
    last[high - 1] = a ^ 1
    if high - low == 2:
        return
    b: cython.int = _new_edge(origin, after, before, low + 1, low + 2)
    _put_after(after, before, b, a ^ 1)
    last[high - 1] = b ^ 1
    turn: cython.int = _turn(
        x[low], y[low], x[low + 1], y[low + 1], x[low + 2], y[low + 2]
    )  # fmt: skip
    if turn != 0:
        c: cython.int = _join(origin, after, before, b ^ 1, a)
        if turn < 0:
            first[low] = c ^ 1
            last[high - 1] = c


@cython.cfunc
@cython.exceptval(check=False)
def _merge(
    x: cython.double[::1],
    y: cython.double[::1],
    origin: cython.int[::1],
    after: cython.int[::1],
    before: cython.int[::1],
    first: cython.int[::1],
    last: cython.int[::1],
    low: cython.Py_ssize_t,
    middle: cython.Py_ssize_t,
    high: cython.Py_ssize_t,
) -> cython.void:
    """Sew the triangulations of low..middle and middle..high together, from the bottom up."""
    left: cython.int = last[middle - 1]
    right: cython.int = first[middle]
    base: cython.int
    p: cython.int  # the base runs from point q on the right to point p on the left
    q: cython.int
    a: cython.int  # the point above it that the left set offers, and that of the right
    b: cython.int
    a_cross: cython.double
    a_dot: cython.double
    a_size: cython.double
    b_cross: cython.double
    b_dot: cython.double
    b_size: cython.double
    order: cython.int
    while True:  # down to the line that has both sets above it
        p = origin[left]
        q = origin[right]
        a = origin[left ^ 1]
        b = origin[right ^ 1]
        if _turn(x[p], y[p], x[a], y[a], x[q], y[q]) > 0:
            left = before[left ^ 1]
        elif _turn(x[q], y[q], x[b], y[b], x[p], y[p]) < 0:
            right = after[right ^ 1]
        else:
            break
    base = _join(origin, after, before, right, left)
    if p == low:
        first[low] = base ^ 1
    if q == high - 1:
        last[high - 1] = base
    while True:
        left, a_cross, a_dot, a_size = _nearest(
            x, y, origin, after, before, after, after[base ^ 1], p, q
        )
        right, b_cross, b_dot, b_size = _nearest(
            x, y, origin, after, before, before, before[base], p, q
        )
        a = origin[left ^ 1]
        b = origin[right ^ 1]
        if b_cross > 0.0 and a_cross > 0.0:
            order = _compare(b_cross, b_dot, b_size, a_cross, a_dot, a_size, x, y, p, q, b, a)
            if order == 0:
                order = _tie(p, b, q, a)
        elif b_cross > 0.0:
            order = -1
        elif a_cross > 0.0:
            order = 1
        else:
            return
        if order < 0:
            base = _join(origin, after, before, right ^ 1, base ^ 1)
            q = b
        else:
            base = _join(origin, after, before, base, left ^ 1)
            p = a


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _nearest(
    x: cython.double[::1],
    y: cython.double[::1],
    origin: cython.int[::1],
    after: cython.int[::1],
    before: cython.int[::1],
    onward: cython.int[::1],
    h: cython.int,
    p: cython.int,
    q: cython.int,
) -> tuple[cython.int, cython.double, cython.double, cython.double]:
    """Return the half-edge of one side that may stay, and how its end sees p and q.

    Tried are h and those `onward` of it, `after` it on the left, `before` it on the right; what
    the next one's end makes wrong is deleted. The first number is above 0 if there is one.
    """
    near: cython.int = origin[h]
    far: cython.int = q if near == p else p
    a: cython.int = origin[h ^ 1]
    c: cython.int
    following: cython.int
    order: cython.int
    cross: cython.double
    dot: cython.double
    size: cython.double
    c_cross: cython.double
    c_dot: cython.double
    c_size: cython.double
    cross, dot, size = _sight(x[p], y[p], x[q], y[q], x[a], y[a])
    while cross > 0.0:
        following = onward[h]
        c = origin[following ^ 1]
        c_cross, c_dot, c_size = _sight(x[p], y[p], x[q], y[q], x[c], y[c])
        if c_cross <= 0.0:
            break
        order = _compare(c_cross, c_dot, c_size, cross, dot, size, x, y, p, q, c, a)
        if order == 0:
            order = _tie(far, c, near, a)
        if order > 0:
            break
        _delete(origin, after, before, h)
        h = following
        a = c
        cross, dot, size = c_cross, c_dot, c_size
    return h, cross, dot, size


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _new_edge(
    origin: cython.int[::1],
    after: cython.int[::1],
    before: cython.int[::1],
    start: cython.int,
    end: cython.int,
) -> cython.int:
    """Return a half-edge from `start` to `end`, linked with no other."""
    h: cython.int = after[0]
    if h:
        after[0] = after[h]
    else:
        h = before[0]
        before[0] = h + 2
    origin[h] = start
    after[h] = h
    before[h] = h
    origin[h + 1] = end
    after[h + 1] = h + 1
    before[h + 1] = h + 1
    return h


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _put_after(
    after: cython.int[::1], before: cython.int[::1], h: cython.int, g: cython.int
) -> cython.void:
    """Link half-edge h, which is alone, as the next one counter-clockwise of g."""
    following: cython.int = after[g]
    after[h] = following
    before[h] = g
    before[following] = h
    after[g] = h


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _join(
    origin: cython.int[::1],
    after: cython.int[::1],
    before: cython.int[::1],
    g: cython.int,
    h: cython.int,
) -> cython.int:
    """Return a new half-edge from the origin of g, just clockwise of it, to just after h."""
    e: cython.int = _new_edge(origin, after, before, origin[g], origin[h])
    _put_after(after, before, e, before[g])
    _put_after(after, before, e ^ 1, h)
    return e


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _delete(
    origin: cython.int[::1], after: cython.int[::1], before: cython.int[::1], h: cython.int
) -> cython.void:
    """Give the edge of half-edge h back to the pool."""
    after[before[h]] = after[h]
    before[after[h]] = before[h]
    h ^= 1
    after[before[h]] = after[h]
    before[after[h]] = before[h]
    h &= ~1
    origin[h] = -1
    origin[h + 1] = -1
    after[h] = after[0]
    after[0] = h


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _turn(
    ax: cython.double,
    ay: cython.double,
    bx: cython.double,
    by: cython.double,
    cx: cython.double,
    cy: cython.double,
) -> cython.int:
    """Return 1 where c lies left of the line from a to b, -1 right of it, 0 on it; exact."""
    # rounding keeps order, so products that differ in float64 differ likewise
    one: cython.double = (bx - ax) * (cy - ay)
    other: cython.double = (by - ay) * (cx - ax)
    if one > other:
        return 1
    if one < other:
        return -1
    if abs(one) < _WHOLE:
        return 0
    one = _exact_cross(bx - ax, by - ay, cx - ax, cy - ay)
    return 1 if one > 0.0 else -1 if one < 0.0 else 0


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _sight(
    px: cython.double,
    py: cython.double,
    qx: cython.double,
    qy: cython.double,
    cx: cython.double,
    cy: cython.double,
) -> tuple[cython.double, cython.double, cython.double]:
    """Return cross and dot product of the vectors from c to p and q, and a bound of both.

    The quotient dot/cross is the cotangent of the angle at c; the sign of the cross product is
    exact, positive where c lies above the line from p to q.
    """
    px -= cx
    py -= cy
    qx -= cx
    qy -= cy
    cross: cython.double = px * qy - py * qx
    size: cython.double = (abs(px) + abs(py)) * (abs(qx) + abs(qy))
    if cross == 0.0 and size >= _WHOLE:
        cross = _exact_cross(px, py, qx, qy)
    return cross, px * qx + py * qy, size


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _compare(
    c_cross: cython.double,
    c_dot: cython.double,
    c_size: cython.double,
    d_cross: cython.double,
    d_dot: cython.double,
    d_size: cython.double,
    x: cython.double[::1],
    y: cython.double[::1],
    p: cython.int,
    q: cython.int,
    c: cython.int,
    d: cython.int,
) -> cython.int:
    """Return the sign of the cotangent at c minus that at d; exact.

    It is negative where c is inside the circle through p, q and d.
    """
    difference: cython.double = c_dot * d_cross - d_dot * c_cross
    size: cython.double = c_size * d_size
    if abs(difference) <= _ROUNDING * size and size >= _WHOLE / 2.0:
        return _exact_order(
            x[p] - x[c], y[p] - y[c], x[q] - x[c], y[q] - y[c],
            x[p] - x[d], y[p] - y[d], x[q] - x[d], y[q] - y[d],
        )  # fmt: skip
    return 1 if difference > 0.0 else -1 if difference < 0.0 else 0


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
    return float(int(ux) * int(vy) - int(uy) * int(vx))


@cython.cfunc
@cython.exceptval(check=False)
def _exact_order(
    cpx: cython.double,
    cpy: cython.double,
    cqx: cython.double,
    cqy: cython.double,
    dpx: cython.double,
    dpy: cython.double,
    dqx: cython.double,
    dqy: cython.double,
) -> cython.int:
    """Return the sign of the cotangent between vectors cp and cq minus that between dp and dq."""
    c_dot = int(cpx) * int(cqx) + int(cpy) * int(cqy)
    c_cross = int(cpx) * int(cqy) - int(cpy) * int(cqx)
    d_dot = int(dpx) * int(dqx) + int(dpy) * int(dqy)
    d_cross = int(dpx) * int(dqy) - int(dpy) * int(dqx)
    one = c_dot * d_cross
    other = d_dot * c_cross
    return 1 if one > other else -1 if one < other else 0

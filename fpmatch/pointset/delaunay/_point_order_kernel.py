# mypy: ignore-errors
"""Kernel: scale points to whole numbers and sort them by x, then y, for divide and conquer."""

import math

import cython
import numpy as np

COMPILED = cython.compiled

_WHOLE = cython.declare(cython.double, 2.0**52)  # added and taken away, it rounds what is smaller


def sort_points(points: cython.double[:, ::1], flatness: cython.double) -> tuple | None:
    """Return x and y of the distinct points in order, shape (2, N), their number, and their order.

    ``points`` (N, 2) are finite; None where they are too few, or lie all within `flatness` of
    their extent from one line. Coordinates become whole numbers from 0 to 2**52, the smallest
    that keep their proportions. Of points that coincide the first stands for all.
    ``order`` (2, N) holds, in its first row, the index of each distinct point; in its second, for
    each index, the rank of the point in that order, or -1 - the index of the point that stands
    for it.
    """
    n: cython.Py_ssize_t = points.shape[0]
    if n < 3:
        return None
    in_order = np.empty((2, n))
    index = np.empty((2, n), np.intc)
    whole = np.empty((n, 2))
    given: cython.double[:, ::1] = whole
    xy: cython.double[:, ::1] = in_order
    order: cython.int[:, ::1] = index
    if not _to_whole_numbers(points, given):
        return None
    index[0] = whole.view(np.complex128).ravel().argsort(kind="stable")
    distinct: cython.Py_ssize_t = _take_distinct(given, order[0], order[1], xy[0], xy[1])
    if distinct < 3 or _is_flat(xy[0], xy[1], distinct, flatness):
        return None
    return in_order, distinct, index


@cython.cfunc
@cython.exceptval(check=False)
def _to_whole_numbers(points: cython.double[:, ::1], whole: cython.double[:, ::1]) -> cython.bint:
    """Write the points as whole numbers from 0, at most 2**52 and as small as they can be.

    Return whether there are two that differ.
    """
    cython.declare(n=cython.Py_ssize_t, i=cython.Py_ssize_t, shift=cython.int, bits=cython.longlong)
    n = points.shape[0]
    low_x = high_x = points[0, 0]
    low_y = high_y = points[0, 1]
    for i in range(1, n):
        low_x = min(low_x, points[i, 0])
        high_x = max(high_x, points[i, 0])
        low_y = min(low_y, points[i, 1])
        high_y = max(high_y, points[i, 1])
    extent = max(high_x - low_x, high_y - low_y)
    if extent == 0.0:
        return False
    # two steps, because the power of two itself may be beyond float64
    shift = 52 - math.frexp(extent)[1]
    scale: cython.double = math.ldexp(1.0, shift // 2)
    more: cython.double = math.ldexp(1.0, shift - shift // 2)
    bits = 0
    for i in range(n):
        x: cython.double = (points[i, 0] - low_x) * scale * more + _WHOLE - _WHOLE
        y: cython.double = (points[i, 1] - low_y) * scale * more + _WHOLE - _WHOLE
        bits |= cython.cast(cython.longlong, x) | cython.cast(cython.longlong, y)
        whole[i, 0], whole[i, 1] = x, y
    scale = 1.0 / (bits & -bits)
    for i in range(n):
        whole[i, 0] *= scale
        whole[i, 1] *= scale
    return True


@cython.cfunc
@cython.exceptval(check=False)
def _take_distinct(
    given: cython.double[:, ::1], order: cython.int[::1], place: cython.int[::1],
    x: cython.double[::1], y: cython.double[::1],
) -> cython.Py_ssize_t:  # fmt: skip
    """Write the distinct points in order, the first of those that coincide; return their number.

    `place` receives the rank of each point, or -1 - the first one's index for each of the others.
    """
    cython.declare(count=cython.Py_ssize_t, i=cython.Py_ssize_t, point=cython.int)
    count = 0
    for i in range(order.shape[0]):
        point = order[i]
        if count > 0 and given[point, 0] == x[count - 1] and given[point, 1] == y[count - 1]:
            place[point] = -1 - order[count - 1]
        else:
            place[point] = count
            order[count] = point
            x[count], y[count] = given[point, 0], given[point, 1]
            count += 1
    return count


@cython.cfunc
@cython.exceptval(check=False)
def _is_flat(
    x: cython.double[::1], y: cython.double[::1], count: cython.Py_ssize_t, flatness: cython.double,
) -> cython.bint:  # fmt: skip
    """Return whether no point is further than `flatness` of the longest chord from its line."""
    cython.declare(i=cython.Py_ssize_t)
    axis_x = axis_y = longest = 0.0
    for i in range(1, count):
        dx, dy = x[i] - x[0], y[i] - y[0]
        if dx * dx + dy * dy > longest:
            longest = dx * dx + dy * dy
            axis_x, axis_y = dx, dy
    for i in range(1, count):
        if abs(axis_x * (y[i] - y[0]) - axis_y * (x[i] - x[0])) > flatness * longest:
            return False
    return True

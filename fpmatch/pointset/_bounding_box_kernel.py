"""Kernel: the bounding box of points, and whether all of them are finite.

Interpreted, the function runs as it stands.
"""

import cython

COMPILED = cython.compiled


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
def bounding_box(points: cython.double[:, ::1], box: cython.double[::1]) -> cython.bint:
    """Write least and largest x, least and largest y of points (N, 2), N > 0.

    Returned is whether all coordinates are finite; only then is the box of any use.
    """
    i: cython.Py_ssize_t
    x: cython.double
    y: cython.double
    left: cython.double = points[0, 0]
    right: cython.double = left
    top: cython.double = points[0, 1]
    bottom: cython.double = top
    most: cython.double = 1.7976931348623157e308
    finite: cython.bint = True
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        if not (-most <= x <= most and -most <= y <= most):
            finite = False
        if x < left:
            left = x
        if x > right:
            right = x
        if y < top:
            top = y
        if y > bottom:
            bottom = y
    box[0] = left
    box[1] = right
    box[2] = top
    box[3] = bottom
    return finite

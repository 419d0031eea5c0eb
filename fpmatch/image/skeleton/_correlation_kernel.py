"""Kernel: sums of the products of two images around listed pixels, weighed by a Gaussian.

``sums[i] = Σ_r Σ_c weight[r] · weight[c] · (a · b, a · a, b · b)`` over a square around (x[i],
y[i]), as far as the images reach. Its oracle is `fpmatch.image.skeleton.minutia_quality.sum_with_numpy`.
"""

import cython

COMPILED = cython.compiled


@cython.boundscheck(False)
@cython.wraparound(False)
def sum_around(
    a: cython.const[cython.float][:, :],
    b: cython.const[cython.float][:, :],
    x: cython.const[cython.int][::1],
    y: cython.const[cython.int][::1],
    weight: cython.const[cython.double][::1],
    sums: cython.double[:, ::1],
) -> None:
    """Write the sums around each pixel to `sums`; `weight` is of odd length."""
    height: cython.Py_ssize_t = a.shape[0]
    width: cython.Py_ssize_t = a.shape[1]
    radius: cython.Py_ssize_t = weight.shape[0] // 2
    i: cython.Py_ssize_t
    row: cython.Py_ssize_t
    column: cython.Py_ssize_t
    left: cython.Py_ssize_t
    right: cython.Py_ssize_t
    w: cython.double
    u: cython.double
    v: cython.double
    with cython.nogil:
        for i in range(x.shape[0]):
            left = max(x[i] - radius, 0)
            right = min(x[i] + radius + 1, width)
            for row in range(max(y[i] - radius, 0), min(y[i] + radius + 1, height)):
                for column in range(left, right):
                    w = weight[row - y[i] + radius] * weight[column - x[i] + radius]
                    u = cython.cast(cython.double, a[row, column])
                    v = cython.cast(cython.double, b[row, column])
                    sums[i, 0] += w * (u * v)
                    sums[i, 1] += w * (u * u)
                    sums[i, 2] += w * (v * v)

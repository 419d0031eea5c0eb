# mypy: ignore-errors
"""Kernel: the inner product of the neighbourhood of each listed pixel with one filter of a bank.

``out[y, x] = Σ_r Σ_c bank[k, r, c] · padded[y + r, x + c]`` for every listed (y, x, k). The rows of
the bank are padded with zeros to `ROW` values, a constant that the compiler can vectorize. Its
oracle is `fpmatch.image.enhancement.gabor.filter_with_numpy`.
"""

import cython

COMPILED = cython.compiled

ROW = 28


def filter_pixels(
    padded: cython.float[:, ::1],
    y: cython.int[::1],
    x: cython.int[::1],
    which: cython.int[::1],
    bank: cython.float[:, :, ::1],
    out: cython.float[:, ::1],
) -> None:
    """Write the filtered values of the listed pixels to `out`."""
    cython.declare(i=cython.Py_ssize_t, r=cython.Py_ssize_t, c=cython.Py_ssize_t)
    cython.declare(top=cython.Py_ssize_t, left=cython.Py_ssize_t, total=cython.float)
    rows: cython.Py_ssize_t = bank.shape[1]
    sums = cython.declare(cython.float[28])
    weights: cython.pointer(cython.float)
    source: cython.pointer(cython.float)
    with cython.nogil:
        for i in range(y.shape[0]):
            top = y[i]
            left = x[i]
            for c in range(28):
                sums[c] = 0.0
            for r in range(rows):
                weights = cython.address(bank[which[i], r, 0])
                source = cython.address(padded[top + r, left])
                for c in range(28):
                    sums[c] += weights[c] * source[c]
            total = 0.0
            for c in range(28):
                total += sums[c]
            out[top, left] = total

"""Kernel: the mean, over each square cell, of the product of two images.

A row of cells is summed up pixel column by pixel column, which the compiler turns into vector
instructions; no image of products is made. Its oracle is `fpmatch.image.preprocess.blocks.pixels_to_blocks` of
that image.
"""

import cython

COMPILED = cython.compiled


@cython.boundscheck(False)
@cython.wraparound(False)
def mean_products(
    a: cython.const[cython.float][:, ::1],
    b: cython.const[cython.float][:, ::1],
    step: cython.Py_ssize_t,
    column_sums: cython.float[::1],
    means: cython.float[:, ::1],
) -> None:
    """Write the mean of a · b over each cell of `step` by `step` pixels to `means`.

    Where the last cells reach beyond the images, the last row and column of these are repeated.
    `column_sums`, as long as a row of whole cells, is scratch space.
    """
    height: cython.Py_ssize_t = a.shape[0]
    width: cython.Py_ssize_t = a.shape[1]
    row: cython.Py_ssize_t
    column: cython.Py_ssize_t
    x: cython.Py_ssize_t
    y: cython.Py_ssize_t
    k: cython.Py_ssize_t
    total: cython.float
    scale: cython.float = 1.0 / (step * step)
    u: cython.pointer(cython.const[cython.float])
    v: cython.pointer(cython.const[cython.float])
    sums: cython.pointer(cython.float) = cython.address(column_sums[0])
    with cython.nogil:
        for row in range(means.shape[0]):
            for x in range(column_sums.shape[0]):
                sums[x] = 0.0
            for k in range(step):
                y = min(row * step + k, height - 1)
                u = cython.address(a[y, 0])
                v = cython.address(b[y, 0])
                for x in range(width):
                    sums[x] += u[x] * v[x]
            for x in range(width, column_sums.shape[0]):
                sums[x] = sums[width - 1]
            for column in range(means.shape[1]):
                total = 0.0
                for k in range(step):
                    total += sums[column * step + k]
                means[row, column] = total * scale

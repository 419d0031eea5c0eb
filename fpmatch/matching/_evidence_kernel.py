"""Kernel: what the two prints say to an alignment: ring points kept, and ridges that agree.

Minutiae, transforms and fields are as `_align_kernel` has them. Interpreted, the functions run as
they stand.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import floor
else:
    from math import floor

COMPILED = cython.compiled


@cython.boundscheck(False)
@cython.wraparound(False)
def ring_agreement(
    partner: cython.int[::1],
    start_a: cython.int[::1],
    ring_a: cython.int[::1],
    circle_a: cython.double[:, ::1],
    start_b: cython.int[::1],
    ring_b: cython.int[::1],
    circle_b: cython.double[:, ::1],
) -> cython.double:
    """Return the agreement on the unit circle of the one-rings of all pairs.

    For each pair of minutiae and each point of the one's ring whose partner stands in the other's:
    the smaller of their weights times the cosine between their places on the circle.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    m: cython.Py_ssize_t
    other: cython.int
    weight: cython.double
    total: cython.double = 0.0
    for i in range(partner.shape[0]):
        j = partner[i]
        if j < 0:
            continue
        for k in range(start_a[i], start_a[i + 1]):
            other = partner[ring_a[k]]
            if other < 0:
                continue
            for m in range(start_b[j], start_b[j + 1]):
                if ring_b[m] == other:
                    weight = circle_a[2, k]
                    if circle_b[2, m] < weight:
                        weight = circle_b[2, m]
                    total += weight * (
                        circle_a[0, k] * circle_b[0, m] + circle_a[1, k] * circle_b[1, m]
                    )
                    break
    return total


@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def field_agreement(
    transform: cython.double[::1],
    cells_a: cython.double[:, ::1],
    step_b: cython.double,
    flow_b: cython.double[:, :, ::1],
    mask_b: cython.uchar[:, ::1],
    sums: cython.double[::1],
) -> None:
    """Lay the orientation field of A over that of B.

    `cells_a` (4, K) holds x, y of the cells of A inside its mask, and the cosine and sine of twice
    their orientation; `flow_b` (2, rows, columns) the same for B. ``sums[0]`` receives the number
    of cells that fall into B's mask, ``sums[1]`` the sum of the cosines of twice the difference.
    """
    k: cython.Py_ssize_t
    row: cython.int
    column: cython.int
    x: cython.double
    y: cython.double
    c: cython.double
    s: cython.double
    scale: cython.double = transform[0] * transform[0] + transform[1] * transform[1]
    turn_c: cython.double
    turn_s: cython.double
    turn_c = (transform[0] * transform[0] - transform[1] * transform[1]) / scale
    turn_s = 2.0 * transform[0] * transform[1] / scale
    sums[0] = 0.0
    sums[1] = 0.0
    for k in range(cells_a.shape[1]):
        x = transform[2] + transform[0] * cells_a[0, k] - transform[1] * cells_a[1, k]
        y = transform[3] + transform[1] * cells_a[0, k] + transform[0] * cells_a[1, k]
        x = floor(x / step_b)
        y = floor(-y / step_b)
        if x < 0.0 or y < 0.0 or x >= mask_b.shape[1] or y >= mask_b.shape[0]:
            continue
        column = cython.cast(cython.int, x)
        row = cython.cast(cython.int, y)
        if mask_b[row, column] == 0:
            continue
        c = turn_c * cells_a[2, k] - turn_s * cells_a[3, k]
        s = turn_s * cells_a[2, k] + turn_c * cells_a[3, k]
        sums[0] += 1.0
        sums[1] += c * flow_b[0, row, column] + s * flow_b[1, row, column]

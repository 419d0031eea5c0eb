"""Kernel: the likeness of every neighbourhood of one print to every neighbourhood of the other.

A neighbour stands in the frame of its minutia: position (u, v), turned so that the minutia's own
direction is +u, and direction (c, s) relative to it. A neighbour is as like another as their
distance, against a tolerance that grows with the neighbour's own distance, and their difference
in direction allow; each neighbour looks for the one most like it on the other side, and one that
finds none counts nothing: neighbours may be missing or spurious on either side. Interpreted, it
runs as it stands; its oracle in the tests is written in numpy.
"""

import cython

COMPILED = cython.compiled


@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def neighbourhood_likeness(
    count_a: cython.int[::1],
    frame_a: cython.float[:, :, ::1],
    count_b: cython.int[::1],
    frame_b: cython.float[:, :, ::1],
    min_cosine: cython.float,
    likeness: cython.float[:, ::1],
) -> None:
    """Fill ``likeness[i, j]`` for all minutiae i of A and j of B.

    ``frame[i, :, k]`` holds, for neighbour k of minutia i: u, v, c, s, 1/tolerance², weight.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    m: cython.Py_ssize_t
    u: cython.float
    v: cython.float
    c: cython.float
    s: cython.float
    du: cython.float
    dv: cython.float
    near: cython.float
    turn: cython.float
    value: cython.float
    best: cython.float
    total: cython.float
    scale: cython.float = 1.0 / (1.0 - min_cosine)
    with cython.nogil:
        for i in range(count_a.shape[0]):
            for j in range(count_b.shape[0]):
                total = 0.0
                for k in range(count_a[i]):
                    u = frame_a[i, 0, k]
                    v = frame_a[i, 1, k]
                    c = frame_a[i, 2, k]
                    s = frame_a[i, 3, k]
                    best = 0.0
                    for m in range(count_b[j]):
                        du = frame_b[j, 0, m] - u
                        dv = frame_b[j, 1, m] - v
                        near = 1.0 - (du * du + dv * dv) * frame_a[i, 4, k]
                        if near <= 0.0:
                            continue
                        turn = (c * frame_b[j, 2, m] + s * frame_b[j, 3, m] - min_cosine) * scale
                        if turn <= 0.0:
                            continue
                        value = near * turn * frame_b[j, 5, m]
                        if value > best:
                            best = value
                    total += best * frame_a[i, 5, k]
                likeness[i, j] = total

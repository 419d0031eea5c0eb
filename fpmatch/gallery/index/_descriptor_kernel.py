# mypy: ignore-errors
"""Kernel: scores of the bit descriptors of a probe with many prints."""

import cython


@cython.locals(k=cython.Py_ssize_t, i=cython.Py_ssize_t, w=cython.Py_ssize_t)
def score_prints(
    tables,
    start,
    xy,
    direction_bin,
    neighbour_bits,
    orientation_bins,
    has_flow,
    which,
    places,
    room,
    words,
    bins,
    score,
):
    """Fill `score` with what the prints `which` have in common with the print in the tables.

    The minutiae of print k are those from ``start[k]`` to ``start[k + 1]``; `room`, `words`
    and `bins` are for one print: its positions, and all words of a minutia, of which the first
    neighbours and the `places` of ridge orientation are kept. Other threads may run meanwhile.
    """
    with cython.nogil:
        for t in range(which.shape[0]):
            k = which[t]
            first: cython.Py_ssize_t = start[k]
            last: cython.Py_ssize_t = start[k + 1]
            for i in range(first, last):
                room[i - first, 0] = xy[i, 0]
                room[i - first, 1] = xy[i, 1]
                for w in range(neighbour_bits.shape[1]):
                    words[i - first, w] = neighbour_bits[i, w]
                for w in range(orientation_bins.shape[1]):
                    bins[i - first, places[w]] = orientation_bins[i, w]
            score[t] = tables.score(
                0,
                last - first,
                room,
                direction_bin[first:last],
                words,
                bins,
                has_flow[k],
                False,
            )
    return 0

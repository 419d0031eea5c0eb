# mypy: ignore-errors
"""Kernel: how similar the prints of a segment are to a probe by votes, embeddings and descriptors.

Each posting that a probe's term finds votes for a print, and for the rotation and the shift that
map the probe's edge onto that of the print. Votes are counted in cells: 4 by 4 of shifts, of 64 by
64 pixels, which repeat after 256, by 16 of rotation. What a print has is the greatest sum of four
cells: two adjacent ones along x by two of rotation, so that votes for nearly the same movement are
added up although they lie in two cells.
"""

import cython
from cython.cimports.fpmatch.gallery.index._vote_cells import (
    AHEAD,
    CELLS,
    LENGTH,
    MOST,
    PRODUCT_BITS,
    TURN,
    TURNED,
    WORDS,
    most_votes,
    prefetch,
)
from cython.cimports.fpmatch.matching.prints._kernels._prefilter_kernel import Prefilter
from cython.cimports.libc.string import memset


@cython.locals(q=cython.Py_ssize_t, p=cython.Py_ssize_t, at=cython.uint, votes_each=cython.uint)
def count_votes(
    start: cython.const[cython.uint][::1],
    posting: cython.const[cython.uint][::1],
    term: cython.const[cython.int][::1],
    weight: cython.const[cython.uchar][::1],
    reading: cython.const[cython.int][::1],
    shift: cython.const[cython.ushort][:, ::1],
    factor: cython.const[cython.ushort][::1],
    table: cython.uint[::1],
    votes: cython.ushort[::1],
):
    """Fill `votes` with the greatest sum of the votes of each print in four cells.

    The postings of a term are ``posting[start[term]:start[term + 1]]``, in the order of the prints:
    the number of the print in the upper half, the pose in the lower one. `term`, `weight` and
    `reading` are the probe's; ``shift[r, k]`` belongs to a reading, and to a print's edge of
    direction k: the place x, y of the probe's edge after the rotation onto it, as poses are
    quantised, and the cell of the rotation in the higher bits. A quarter of `factor` multiplies the
    votes of each print. `table` is room: 64 numbers a print. Other threads may run meanwhile.
    """
    with cython.nogil:
        cells = cython.cast(cython.p_uchar, cython.address(table[0]))
        memset(cells, 0, votes.shape[0] * CELLS)
        for q in range(term.shape[0]):
            place = cython.address(shift[reading[q], 0])
            votes_each = weight[q]
            if q + 2 * AHEAD < term.shape[0]:
                prefetch(cython.address(start[term[q + 2 * AHEAD]]))
                ahead = cython.address(posting[0]) + start[term[q + AHEAD]]
                prefetch(ahead)
                prefetch(ahead + 16)
            for at in range(start[term[q]], start[term[q] + 1]):
                posted = posting[at]
                own: cython.uint = place[posted >> 10 & TURN]
                # the highest two bits of x and of y, without a carry from y to x
                cell: cython.uint = (((posted | 31) - own) >> 2 & 192) + ((posted - own) >> 3 & 3)
                cell += (posted >> 16) * CELLS + (own >> 8 & 60)
                count = cells[cell] + votes_each
                cells[cell] = count if count < MOST else MOST
        for p in range(votes.shape[0]):
            here = cython.address(table[p * WORDS])
            votes[p] = most_votes(here) * factor[p] >> 2


@cython.locals(p=cython.Py_ssize_t, k=cython.Py_ssize_t)
def compare_embeddings(
    embedding: cython.const[cython.schar][:, ::1],
    probe: cython.const[cython.short][:, ::1],
    similarity: cython.ushort[::1],
):
    """Fill `similarity` with how similar the embedding of each print, (N, L), is to the probe's.

    Of the probe there are four, (4, L): of the print as it is given, and turned. The greatest
    product counts, less `TURNED` for one that is turned, and 0 where all point away. Other threads
    may run meanwhile.
    """
    with cython.nogil:
        for p in range(embedding.shape[0]):
            given: cython.int = 0
            left: cython.int = 0
            down: cython.int = 0
            right: cython.int = 0
            for k in range(LENGTH):  # all four at once: a number is read and widened once
                own: cython.short = embedding[p, k]
                given += own * probe[0, k]
                left += own * probe[1, k]
                down += own * probe[2, k]
                right += own * probe[3, k]
            turned = (max(left, down, right) >> PRODUCT_BITS) - TURNED
            similarity[p] = max(0, given >> PRODUCT_BITS, turned)


@cython.locals(t=cython.Py_ssize_t, i=cython.Py_ssize_t, w=cython.Py_ssize_t)
def score_prints(
    tables: Prefilter,
    start: cython.const[cython.longlong][::1],
    xy: cython.const[cython.short][:, ::1],
    direction_bin: cython.const[cython.uchar][::1],
    neighbour_bits: cython.const[cython.ushort][:, ::1],
    orientation_bins: cython.const[cython.uchar][:, ::1],
    has_flow: cython.const[cython.uchar][::1],
    which: cython.const[cython.longlong][::1],
    places: cython.const[cython.int][::1],
    room: cython.float[:, ::1],
    words: cython.ushort[:, ::1],
    bins: cython.uchar[:, ::1],
    score: cython.int[::1],
):
    """Fill `score` with what the prints `which` have in common with the print in the tables.

    The minutiae of print k are those from ``start[k]`` to ``start[k + 1]``; `room`, `words`
    and `bins` are for one print: its positions, and all words of a minutia, of which the first
    neighbours and the `places` of ridge orientation are kept. Other threads may run meanwhile.
    """
    with cython.nogil:
        for t in range(which.shape[0]):
            k: cython.Py_ssize_t = which[t]
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

# mypy: ignore-errors
"""Kernel: votes of a probe's terms for the prints of a segment, and for how to move the probe.

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
    MOST,
    MOST_VOTES,
    PRINT_BITS,
    PRINTS,
    PRODUCT_BITS,
    TURN,
    WORDS,
    most_votes,
    prefetch,
)
from cython.cimports.libc.string import memset


def count_votes(start, posting, term, weight, reading, shift, factor, cursor, table, votes):
    """Fill `votes` with the greatest sum of the votes of each print in four cells.

    The postings of a term are ``posting[start[term]:start[term + 1]]``, in the order of the prints:
    the number of the print in the upper half, the pose in the lower one. `term`, `weight` and
    `reading` are the probe's; ``shift[r, k]`` belongs to a reading, and to a print's edge of
    direction k: the place x, y of the probe's edge after the rotation onto it, as poses are
    quantised, and the cell of the rotation in the higher bits. A quarter of `factor` multiplies the
    votes of each print. `cursor` and `table` are room: one number a term, and 64 for 4,096 prints.
    Other threads may run meanwhile.
    """
    with cython.nogil:
        _count_votes(start, posting, term, weight, reading, shift, factor, cursor, table, votes)
    return 0


@cython.locals(at=cython.uint, votes_each=cython.uint)
def _count_votes(start, posting, term, weight, reading, shift, factor, cursor, table, votes):
    """Do what `count_votes` does."""
    for q in range(term.shape[0]):
        cursor[q] = start[term[q]]
    cells = cython.cast(cython.p_uchar, cython.address(table[0]))
    first = 0
    while first < votes.shape[0]:
        last = min(first + PRINTS, votes.shape[0])
        memset(cells, 0, (last - first) * CELLS)
        limit: cython.uint = (cython.cast(cython.ulonglong, last) << 16) - 1
        for q in range(term.shape[0]):
            at, end, votes_each = cursor[q], start[term[q] + 1], weight[q]
            place = cython.address(shift[reading[q], 0])
            if q + AHEAD < term.shape[0]:
                prefetch(cython.address(posting[0]) + cursor[q + AHEAD])
                prefetch(cython.address(posting[0]) + cursor[q + AHEAD] + 16)
            while at < end:
                posted = posting[at]
                if posted > limit:
                    break
                at += 1
                own: cython.uint = place[posted >> 10 & TURN]
                # the highest two bits of x and of y, without a carry from y to x
                cell: cython.uint = (((posted | 31) - own) >> 2 & 192) + ((posted - own) >> 3 & 3)
                cell += own >> 8 & 60
                counted = cython.address(cells[(posted >> 8 & PRINT_BITS) + cell])
                count = counted[0] + votes_each
                counted[0] = count if count < MOST else MOST
            cursor[q] = at
        for p in range(first, last):
            here = cython.address(table[(p - first) * WORDS])
            votes[p] = most_votes(here) * factor[p] >> 2
        first = last
    return 0


@cython.locals(k=cython.Py_ssize_t)
def add_similarity(embedding, probe, votes):
    """Add to the `votes` of each print how similar its embedding (N, L) is to the probe's (L,).

    Embeddings that point away from the probe's add nothing. Other threads may run meanwhile.
    """
    with cython.nogil:
        for p in range(embedding.shape[0]):
            product: cython.int = 0
            for k in range(probe.shape[0]):
                product += cython.cast(cython.short, embedding[p, k]) * probe[k]
            total: cython.int = votes[p] + (product >> PRODUCT_BITS if product > 0 else 0)
            votes[p] = total if total < MOST_VOTES else MOST_VOTES
    return 0

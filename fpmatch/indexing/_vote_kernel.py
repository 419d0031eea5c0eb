"""Kernel: votes of a probe's terms for the prints of a segment, and for how to move the probe.

Each posting that a probe's term finds votes for a print, and for the rotation and the shift that
map the probe's edge onto that of the print. Votes are counted in cells: 4 by 4 of shifts, of 64 by
64 pixels, which repeat after 256, by 16 of rotation. What a print has is the greatest sum of four
cells: two adjacent ones along x by two of rotation, so that votes for nearly the same movement are
added up although they lie in two cells.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.indexing._vote_cells import (
        AHEAD,
        CELLS,
        MOST,
        PRINTS,
        TURN,
        TURNS,
        WORDS,
        prefetch,
    )
    from cython.cimports.libc.string import memset


def count_votes(
    start, posting, term, weight, reading, rotation, shift, factor, cursor, table, votes
):
    """Fill `votes` with the greatest sum of the votes of each print in four cells.

    The postings of a term are ``posting[start[term]:start[term + 1]]``, in the order of the prints:
    the number of the print in the upper half, the pose in the lower one. `term`, `weight` and
    `reading` are the probe's; `rotation` (R,) and `shift` (R, 64) belong to its readings: the
    direction of the edge, and its place x, y for each rotation of the probe, as poses are
    quantised. A quarter of `factor` multiplies the votes of each print. `cursor` and `table` are
    room: one number a term, and 64 for 2,048 prints and two. Other threads may run meanwhile.
    """
    with cython.nogil:
        _count_votes(
            start, posting, term, weight, reading, rotation, shift, factor, cursor, table, votes
        )
    return 0


def _count_votes(
    start, posting, term, weight, reading, rotation, shift, factor, cursor, table, votes
):
    """Do what `count_votes` does."""
    for q in range(term.shape[0]):
        cursor[q] = start[term[q]]
    cells = cython.cast(cython.p_uchar, cython.address(table[0]))
    first = 0
    while first < votes.shape[0]:
        last = min(first + PRINTS, votes.shape[0])
        memset(cells, 0, (last - first) * CELLS)
        for q in range(term.shape[0]):
            at, end, votes_each, own = cursor[q], start[term[q] + 1], weight[q], reading[q]
            turn = rotation[own]
            place = cython.address(shift[own, 0])
            if q + AHEAD < term.shape[0]:
                prefetch(cython.address(posting[0]) + cursor[q + AHEAD])
            while at < end:
                found = posting[at]
                p = found >> 16
                if p >= last:
                    break
                at += 1
                turned = ((found >> 10) - turn) & TURN
                own_place = place[turned]
                cell = ((found >> 5) - (own_place >> 5)) << 3 & 192
                cell += turned & 60
                cell += (found - own_place) >> 3 & 3
                counted = cython.address(cells[(p - first) * CELLS + cell])
                count = counted[0] + votes_each
                counted[0] = count if count < MOST else MOST
            cursor[q] = at
        for p in range(first, last):
            here = cython.address(table[(p - first) * WORDS])
            votes[p] = most_votes(here, cython.address(table[PRINTS * WORDS])) * factor[p] >> 2
        first = last
    return 0


def most_votes(cells, room):
    """Return the greatest sum of four cells of a print; `room` is for twice as many cells."""
    for k in range(WORDS - 1):
        room[k] = cells[k] + cells[k + 1]
    for k in range(WORDS // TURNS):  # the last rotation is beside the first
        room[k * TURNS + TURNS - 1] = cells[k * TURNS + TURNS - 1] + cells[k * TURNS]
    sums = room + WORDS
    for k in range(WORDS - TURNS):
        sums[k] = room[k] + room[k + TURNS]
    for k in range(TURNS):
        sums[WORDS - TURNS + k] = room[WORDS - TURNS + k] + room[k]
    each = cython.cast(cython.p_uchar, sums)
    best = each[0]
    for k in range(CELLS):
        best = each[k] if each[k] > best else best
    return best


def lists_ascend(start, posting, prints):
    """Return whether the prints of each list ascend, and are among so many; `start` ascends."""
    for t in range(start.shape[0] - 1):
        before = 0
        for k in range(start[t], start[t + 1]):
            p = posting[k] >> 16
            if p < before or p >= prints:
                return False
            before = p
    return True


if not cython.compiled:
    from fpmatch.indexing import numpy_forms

    count_votes = numpy_forms.count_votes
    lists_ascend = numpy_forms.lists_ascend

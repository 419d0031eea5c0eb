"""Kernel: votes of a probe's terms for the prints of a segment, and for how to move the probe.

Each posting that a probe's term finds votes for a print, and for the rotation and the shift that
lay the probe's edge on that of the print: rotations are counted in windows of an eighth of a turn,
shifts in windows of 64 by 64 pixels, which repeat after 256, and all of it a second time in windows
that begin half a window later. What a print has is the most votes in one window.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.string import memset

ROTATIONS = cython.declare(cython.int, 64)  # steps of an edge's own direction
PLACES = cython.declare(cython.int, 32)  # steps of a place along x and y, after which they repeat
WINDOWS = cython.declare(cython.int, 128)  # of one grid: 8 of rotation by 4 by 4 of shifts
TWO_GRIDS = cython.declare(cython.int, 256)
HALF = cython.declare(cython.int, 4)  # a window, in steps of rotation and of place
PRINTS = cython.declare(cython.int, 2048)  # whose windows lie in the table at once
MOST = cython.declare(cython.int, 250)  # votes that are counted in one window


def count_votes(start, posting, term, weight, reading, rotation, shift, cursor, table, votes):
    """Fill `votes` with the most votes of each print in one window.

    The postings of a term are ``posting[start[term]:start[term + 1]]``, in the order of the prints:
    the number of the print in the upper half, the pose in the lower one. `term`, `weight` and
    `reading` are the probe's; `rotation` (R,) and `shift` (R, 64) belong to its readings: the
    direction of the edge, and its place x, y for each rotation of the probe, as poses are
    quantised. `cursor` and `table` are room: one number a term, and 256 for 2,048 prints.
    """
    for q in range(term.shape[0]):
        cursor[q] = start[term[q]]
    first = 0
    while first < votes.shape[0]:
        last = min(first + PRINTS, votes.shape[0])
        memset(cython.address(table[0]), 0, (last - first) * TWO_GRIDS)
        for p in range(first, last):
            votes[p] = 0
        for q in range(term.shape[0]):
            at, end = cursor[q], start[term[q] + 1]
            while at < end:
                found = posting[at]
                p = found >> 16
                if p >= last:
                    break
                at += 1
                turn = ((found >> 10) - rotation[reading[q]]) & (ROTATIONS - 1)
                place = shift[reading[q], turn]
                x = (found >> 5) - (place >> 5)
                y = found - place
                window = (p - first) * TWO_GRIDS
                window += (turn >> 3 << 4) + ((x >> 1) & 12) + ((y >> 3) & 3)
                count = table[window] + weight[q]
                count = count if count < MOST else MOST
                table[window] = count
                best = votes[p]
                best = count if count > best else best
                turn, x, y = turn + HALF, x + HALF, y + HALF
                window = (p - first) * TWO_GRIDS + WINDOWS
                window += ((turn >> 3 & 7) << 4) + ((x >> 1) & 12) + ((y >> 3) & 3)
                count = table[window] + weight[q]
                count = count if count < MOST else MOST
                table[window] = count
                votes[p] = count if count > best else best
            cursor[q] = at
        first = last
    return 0


if not cython.compiled:
    from fpmatch.indexing import numpy_forms

    count_votes = numpy_forms.count_votes

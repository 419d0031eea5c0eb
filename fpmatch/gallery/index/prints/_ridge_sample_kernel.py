# mypy: ignore-errors
"""Kernel: the binary ridge images of cells from eight samples each (see `ridge_samples`).

What the samples around a cell say of a row of its bits are words of a table, with a byte for each
bit: the highest bit of a byte of their sum is the bit of the image.
"""

import cython

HIGHEST = cython.declare(cython.ulonglong, 0x0101010101010101)  # bits of a word's bytes, moved down
# The product with a word whose bytes are 0 or 1 has byte k as bit k of its highest byte.
GATHER = cython.declare(cython.ulonglong, 0x0102040810204080)
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
OUTSIDE = cython.declare(cython.int, 16)  # a half that is not known


@cython.locals(rows=cython.Py_ssize_t, columns=cython.Py_ssize_t)
def restore(samples, orientation, mask, start, shape, looked_up, table, halves, ridges):
    """Fill `ridges` inside the mask, for the cells of many prints.

    Those of print p are the entries ``start[p]`` to ``start[p + 1]`` of `mask` and `ridges`, row by
    row; its `shape` begins with rows and columns. `samples` and `orientation` are those of the
    cells inside, print by print. `halves` has room for the two halves of the samples of each cell
    of a print and of a border of a cell around them. A row of `looked_up` is which half is looked
    up, and of which cell: so many rows and columns on, plus one; in the fourth place, it is given
    the difference of their places in `halves`. ``table[o, k, h]`` are the words of its value h.
    """
    total = cython.declare(cython.ulonglong[8])
    filled: cython.Py_ssize_t = 0
    with cython.nogil:
        for p in range(start.shape[0] - 1):
            rows, columns = shape[p, 0], shape[p, 1]
            size = (rows + 2) * (columns + 2)
            for k in range(2 * size):
                halves[k] = OUTSIDE
            for k in range(looked_up.shape[0]):
                place: cython.Py_ssize_t = (
                    looked_up[k, 0] * size + looked_up[k, 1] * (columns + 2) + looked_up[k, 2]
                )
                looked_up[k, 3] = place
            inside = filled
            for row in range(rows):
                for column in range(columns):
                    if mask[start[p] + row * columns + column]:
                        place = (row + 1) * (columns + 2) + column + 1
                        halves[place] = samples[inside] & 15
                        halves[size + place] = samples[inside] >> 4
                        inside += 1
            for row in range(rows):
                for column in range(columns):
                    if not mask[start[p] + row * columns + column]:
                        continue
                    o: cython.int = orientation[filled]
                    filled += 1
                    place = row * (columns + 2) + column
                    for m in range(8):
                        total[m] = 0
                    for k in range(looked_up.shape[0]):
                        half: cython.int = halves[place + looked_up[k, 3]]
                        # a loop that compilers turn into sums of several words at once
                        for m in range(8):
                            total[m] += table[o, k, half, m]
                    image = 0
                    for m in range(8):
                        image |= _highest(total[m]) << (8 * m)
                    ridges[start[p] + row * columns + column] = image
    return 0


def _highest(word):
    """Return the highest bits of the bytes of a word, that of the lowest byte first."""
    return (((word >> 7 & HIGHEST) * GATHER) & ALL) >> 56

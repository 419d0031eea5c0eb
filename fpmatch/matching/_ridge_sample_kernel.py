"""Kernel: the binary ridge images of cells from eight samples each (see `ridge_samples`).

What the samples around a cell say of a row of its bits are words of a table, with a byte for each
bit: the highest bit of a byte of their sum is the bit of the image.
"""

import cython

HIGHEST = cython.declare(cython.ulonglong, 0x0101010101010101)  # bits of a word's bytes, moved down
# The product with a word whose bytes are 0 or 1 has byte k as bit k of its highest byte.
GATHER = cython.declare(cython.ulonglong, 0x0102040810204080)
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)


def restore(samples, orientation, mask, looked_up, table, halves, ridges):
    """Fill `ridges` (rows, columns) inside the mask.

    `samples` and `orientation` are those of the cells inside, row by row. `halves` (2, rows + 2,
    columns + 2), 16 everywhere, is filled with the two halves of the samples of each cell. A row of
    `looked_up` is which half is looked up, and of which cell: so many rows and columns on, plus
    one. ``table[o, k, h]`` are the words of its value h.
    """
    inside = 0
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            if mask[row, column]:
                halves[0, row + 1, column + 1] = samples[inside] & 15
                halves[1, row + 1, column + 1] = samples[inside] >> 4
                inside += 1
    inside = 0
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            if not mask[row, column]:
                continue
            o = orientation[inside]
            inside += 1
            t0 = t1 = t2 = t3 = t4 = t5 = t6 = t7 = 0
            for k in range(looked_up.shape[0]):
                half = halves[looked_up[k, 0], row + looked_up[k, 1], column + looked_up[k, 2]]
                t0 += table[o, k, half, 0]
                t1 += table[o, k, half, 1]
                t2 += table[o, k, half, 2]
                t3 += table[o, k, half, 3]
                t4 += table[o, k, half, 4]
                t5 += table[o, k, half, 5]
                t6 += table[o, k, half, 6]
                t7 += table[o, k, half, 7]
            found = _highest(t0) | _highest(t1) << 8 | _highest(t2) << 16 | _highest(t3) << 24
            found |= _highest(t4) << 32 | _highest(t5) << 40 | _highest(t6) << 48
            ridges[row, column] = found | _highest(t7) << 56
    return 0


def _highest(word):
    """Return the highest bits of the bytes of a word, that of the lowest byte first."""
    return (((word >> 7 & HIGHEST) * GATHER) & ALL) >> 56


if not cython.compiled:
    from fpmatch.matching.numpy_forms import ridge_samples

    restore = ridge_samples.restore

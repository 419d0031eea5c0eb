# mypy: ignore-errors
"""Kernel: bit descriptors of a print's minutiae.

Each minutia has a word for each of its neighbours: the cell of position and direction, in the
minutia's own frame, in which the neighbour lies in each of two grids. Twelve more words are the
bins of the ridge orientation at places around it.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.prints._kernels._bits import second

from fpmatch.matching.constants import *

FULL_TURN = cython.declare(cython.double, 2.0 * np.pi)


@cython.locals(k=cython.Py_ssize_t)
def encode_neighbours(count, frame, angle, coded, per_px, word):
    """Fill `word` for the minutiae of a print that are `coded`; the others have none.

    ``frame[i, :, k]`` begins with the position of neighbour k of minutia i in its frame, and
    ``angle[i, k]`` is its direction there, from -π to π. The cells are squares of ``1 / per_px``
    pixels times sectors of direction, of which the first begins at `APART` before 0; those of the
    second grid are shifted by half a cell in all three. Of the neighbours of a minutia in one cell,
    the first counts.
    """
    # the cells of the neighbours so far; -1 where they do not count
    cells = cython.declare(cython.int[12])
    others = cython.declare(cython.int[12])
    with cython.nogil:
        for i in range(count.shape[0]):
            for k in range(NEIGHBOUR_WORDS):
                word[i, k] = NOWHERE
                if not coded[i] or k >= count[i]:
                    continue
                cells[k] = others[k] = -1
                u = float(frame[i, 0, k]) * per_px + CELLS_ALONG // 2
                v = float(frame[i, 1, k]) * per_px + CELLS_ALONG // 2
                if not (0.0 <= u < CELLS_ALONG and 0.0 <= v < CELLS_ALONG):
                    continue
                t = float(angle[i, k]) / FULL_TURN + APART
                t = (t + 1.0 if t < 0.0 else t) * SECTORS
                column: cython.int = int(u)
                row: cython.int = int(v)
                sector: cython.int = int(t)
                sector = sector if sector < SECTORS else SECTORS - 1
                on_column: cython.int = u - column >= 0.5
                on_row: cython.int = v - row >= 0.5
                cells[k] = (row * CELLS_ALONG + column) * SECTORS + sector
                step: cython.int = 4 * on_row + 2 * on_column + (t - sector >= 0.5)
                code: cython.int = cells[k] | step << STEPS
                for m in range(k):
                    code |= NOT_FIRST * (cells[m] == cells[k])
                if row + on_row == CELLS_ALONG or column + on_column == CELLS_ALONG:
                    code |= NOT_SECOND
                else:
                    others[k] = second(code)
                    for m in range(k):
                        code |= NOT_SECOND * (others[m] == others[k])
                word[i, k] = code
    return 0


@cython.locals(k=cython.Py_ssize_t)
def encode_orientations(points, direction_bin, cell, first_row, first_column, step, places, word):
    """Fill `word` with the bin of the ridge orientation at `places`, in each minutia's own frame.

    Where it is not known, `word` is left as it is. `direction_bin` is a minutia's direction in
    256ths of a turn; `cell`, and what follows, are as `PrintArea` has them.
    """
    with cython.nogil:
        for i in range(word.shape[0]):
            c, s = points[2, i], points[3, i]
            for k in range(ORIENTATION_WORDS):
                x = (points[0, i] + c * places[0, k] - s * places[1, k]) / step - first_column
                y = -(points[1, i] + s * places[0, k] + c * places[1, k]) / step - first_row
                if not (0.0 <= x < cell.shape[1] and 0.0 <= y < cell.shape[0]):
                    continue
                row: cython.Py_ssize_t = int(y)
                column: cython.Py_ssize_t = int(x)
                code: cython.int = cell[row, column]
                if code > 0:
                    # in bins: a turn has 256 steps of direction, half a turn 255 of orientation
                    relative = (code - 1.0) * ORIENTATION_BINS / ORIENTATIONS
                    relative -= direction_bin[i] * (2.0 * ORIENTATION_BINS / 256.0)
                    while relative < 0.0:
                        relative += ORIENTATION_BINS
                    code = int(relative)
                    word[i, k] = code if code < ORIENTATION_BINS else ORIENTATION_BINS - 1
    return 0

# mypy: ignore-errors
"""Kernel: the local similarity of every minutia of one print to every minutia of the other.

A neighbour is described in the frame of its minutia, whose direction is +u: by its position (u, v)
and its relative direction (c, s). The similarity of two neighbours decreases with their distance,
relative to a tolerance that grows with the distance from the minutia, and with their difference in
direction. Each neighbour of print A counts by the most similar neighbour in B, or not at all:
neighbours may be missing or spurious in either print.

The neighbours of one print are sorted once into cells of position and direction; each cell lists
all neighbours that may be similar to one in it. Those of other prints are looked up there.
"""

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt

EIGHTHS = cython.declare(cython.Py_ssize_t, 8)  # of a turn: the cells of direction
CELL_PX = cython.declare(cython.double, 20.0)
HALF = cython.declare(cython.Py_ssize_t, 7)  # cells; both set the time it takes, no more
# least 1/tolerance² of very distant neighbours, where it would underflow
LEAST_PRECISION = cython.declare(cython.double, 1e-30)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def eighth(c: cython.double, s: cython.double) -> cython.Py_ssize_t:
    """Return the number of the eighth of the turn that contains a direction."""
    # sums of truth values: a branch would be mispredicted often
    found: cython.Py_ssize_t = c < 0.0
    found += 2 * (s < 0.0)
    found += 4 * (fabs(s) > fabs(c))
    return found


@cython.final
@cython.cclass
class NeighbourIndex:
    """The neighbours of one print's minutiae, sorted into cells of position and direction.

    ``frame[i, :, k]`` holds, for neighbour k of minutia i: u, v, c, s, 1/tolerance², weight. The
    cells are squares of 20 px, seven from the middle to each border, of which the outermost are
    unbounded. A neighbour is listed in all cells within its own tolerance times `slack` and an
    angle of the largest difference in direction. With a slack of 1/(1 - growth) it is found also
    where the tolerance of the other print is used, which grows likewise with the distance. Other
    prints have at most as many neighbours for each minutia.
    """

    def __init__(self, count, frame, parameters) -> None:
        p = parameters
        self.minutiae, _, self.size = frame.shape
        self.fewest = p.fewest_neighbours
        self.min_cosine = p.neighbour_cosine
        self.slack = 1.0 / (1.0 - p.tolerance_per_px)
        widest = np.arccos(p.neighbour_cosine) + np.pi / EIGHTHS + 1e-3
        self.least = np.cos(min(widest, np.pi))
        middle = np.pi / EIGHTHS * np.arange(1, 2 * EIGHTHS, 2)
        self.middle = np.empty((EIGHTHS, 2))
        for c, s in zip(np.cos(middle), np.sin(middle), strict=True):
            self.middle[eighth(c, s), 0], self.middle[eighth(c, s), 1] = c, s
        self.best = np.zeros(self.minutiae * self.size)
        self.total = np.zeros(self.minutiae)
        self.root_weight = np.asarray(frame)[:, 5].T.astype(np.float64).ravel()
        self.share = 1.0 / np.sqrt(np.maximum(count, self.fewest))
        self.entry = np.empty((self.minutiae * self.size, 6))
        self.owner = np.empty(self.minutiae * self.size, np.int32)
        self.start = np.zeros(4 * HALF * HALF * EIGHTHS + 2, np.int32)
        self.item = np.empty(self._list(count, frame, False), np.int32)
        self._list(count, frame, True)

    @cython.locals(k=cython.Py_ssize_t)
    def _list(self, count, frame, filling):
        """Count the entries of all cells, or else, if `filling`, list them; return their number.

        The starts run one ahead while the cells are filled, two while their entries are counted.
        """
        in_reach = cython.declare(cython.Py_ssize_t[8])
        n = self.minutiae
        for i in range(n):
            for k in range(count[i]):
                e = k * n + i
                for row in range(6):
                    self.entry[e, row] = frame[i, row, k]
                self.owner[e] = i
                u, v, c, s = self.entry[e, 0], self.entry[e, 1], self.entry[e, 2], self.entry[e, 3]
                turns = 0
                for turn in range(EIGHTHS):
                    if c * self.middle[turn, 0] + s * self.middle[turn, 1] >= self.least:
                        in_reach[turns] = turn
                        turns += 1
                reach = self.slack / sqrt(max(self.entry[e, 4], LEAST_PRECISION)) * 1.001 + 0.01
                for row in range(self._line(v - reach), self._line(v + reach) + 1):
                    for column in range(self._line(u - reach), self._line(u + reach) + 1):
                        for turn in range(turns):
                            cell = (row * 2 * HALF + column) * EIGHTHS + in_reach[turn]
                            if filling:
                                self.item[self.start[cell + 1]] = e
                            self.start[cell + 2 - filling] += 1
        cells = 4 * HALF * HALF * EIGHTHS
        if not filling:
            for cell in range(cells):
                self.start[cell + 2] += self.start[cell + 1]
        return self.start[cells + 1 - filling]

    def _line(self, place):
        """Return the row or column of cells of a coordinate."""
        place = place / CELL_PX + HALF
        if not place > 0.0:
            return 0
        return int(place) if place < 2 * HALF else 2 * HALF - 1

    @cython.locals(k=cython.Py_ssize_t, at=cython.Py_ssize_t, e=cython.Py_ssize_t)
    @cython.locals(precision=cython.double, weight=cython.double)
    def to_prints(self, count, frame, minutiae, similarity, before):
        """Fill ``similarity[i, j]`` for the minutiae i of print A and j of print B.

        The print of the index is B, and the other comes `before` it, or it is A. `count` and
        `frame` belong to the other, of which the first `minutiae` are compared. Similarities are
        divided by the geometric mean of the neighbourhoods' sizes, each at least `fewest`. A
        neighbour in A counts by the most similar one in B.
        """
        n, min_cosine = self.minutiae, self.min_cosine
        scale = 0.25 / (1.0 - min_cosine)  # either factor below is doubled
        entry, owner, item, start = self.entry, self.owner, self.item, self.start
        best, total, root_weight = self.best, self.total, self.root_weight
        for i in range(minutiae):
            for k in range(count[i]):
                u = float(frame[i, 0, k])
                v = float(frame[i, 1, k])
                c = float(frame[i, 2, k])
                s = float(frame[i, 3, k])
                precision = float(frame[i, 4, k])
                weight = float(frame[i, 5, k])
                cell = self._line(v) * 2 * HALF + self._line(u)
                cell = cell * EIGHTHS + eighth(c, s)
                for at in range(start[cell], start[cell + 1]):
                    e = item[at]
                    if before:
                        weight = entry[e, 5]
                    else:
                        precision = entry[e, 4]
                    du = u - entry[e, 0]
                    dv = v - entry[e, 1]
                    near = 1.0 - (du * du + dv * dv) * precision
                    turn = (c * entry[e, 2] + s * entry[e, 3] - min_cosine) * scale
                    # twice each value, or 0 where it is negative, without a branch
                    near = (near + fabs(near)) * (turn + fabs(turn)) * weight
                    if before:
                        e = k * n + owner[e]
                    # a value of its own: the compiler then takes the maximum without a branch
                    most = best[e]
                    best[e] = near if near > most else most
            share = 1.0 / sqrt(max(count[i], self.fewest))
            for k in range(count[i] if before else self.size):
                weight = float(frame[i, 5, k]) if before else 0.0
                for j in range(n):
                    e = k * n + j
                    total[j] += best[e] * (weight if before else root_weight[e])
                    best[e] = 0.0
            for j in range(n):
                raw: cython.float = total[j]
                if before:
                    similarity[i, j] = raw * (share * self.share[j])
                else:
                    similarity[j, i] = raw * (share * self.share[j])
                total[j] = 0.0
        return 0

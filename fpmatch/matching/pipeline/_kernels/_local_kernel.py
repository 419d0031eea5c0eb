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
ROOTS = cython.declare(cython.int, 64)
INVERSE_ROOT = cython.declare(cython.double[::1], 1.0 / np.sqrt(np.maximum(np.arange(64.0), 1.0)))
# least 1/tolerance² of very distant neighbours, where it would underflow
LEAST_PRECISION = cython.declare(cython.double, 1e-30)


def _middle_of(number):
    """Return the direction in the middle of an eighth of the turn, by the number `eighth` gives."""
    c, s = np.cos(np.pi / 8), np.sin(np.pi / 8)
    if number & 4:
        c, s = s, c
    return (-c if number & 1 else c), (-s if number & 2 else s)


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


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _agreement(
    entry: cython.double[:, ::1],
    e: cython.Py_ssize_t,
    u: cython.double,
    v: cython.double,
    c: cython.double,
    s: cython.double,
    min_cosine: cython.double,
    scale: cython.double,
    precision: cython.double,
) -> cython.double:
    """Return the product of the agreement of a neighbour with entry e in position and direction."""
    du: cython.double = u - entry[e, 0]
    dv: cython.double = v - entry[e, 1]
    near: cython.double = 1.0 - (du * du + dv * dv) * precision
    turn: cython.double = (c * entry[e, 2] + s * entry[e, 3] - min_cosine) * scale
    # twice the value, or 0 where it is negative, without a branch
    return (near + fabs(near)) * (turn + fabs(turn))


@cython.final
@cython.cclass
class NeighbourIndex:
    """The neighbours of one print's minutiae, sorted into cells of position and direction.

    ``frame[i, :, k]`` holds, for neighbour k of minutia i: u, v, c, s, 1/tolerance², weight. The
    cells are squares of `side` px, `half` of them from the middle to each border; the outermost are
    unbounded. A neighbour is listed in all cells within its own tolerance times `slack` and an
    angle of `max_turn`. A slack of 1 suffices where the tolerance of the indexed print is used; of
    1/(1 - growth) also where that of the other print is used, which grows likewise with the
    distance. Other prints have at most `other_size` neighbours for each minutia.
    """

    def __init__(self, count, frame, side, half, max_turn, slack, other_size) -> None:
        self.minutiae = count.shape[0]
        self.size = frame.shape[2]
        self.half = half
        self.per_px = 1.0 / side
        self.slack = slack
        self.least = np.cos(min(max_turn + np.pi / 8 + 1e-3, np.pi))
        self.middle = np.array([_middle_of(turn) for turn in range(EIGHTHS)])
        self.best = np.zeros(self.minutiae * max(self.size, other_size))
        self.total = np.zeros(self.minutiae)
        self.root_weight = np.asarray(frame)[:, 5].T.astype(np.float64).ravel()
        self.entry = np.empty((self.minutiae * self.size, 6))
        self.owner = np.empty(self.minutiae * self.size, np.int32)
        self.start = np.zeros(4 * half * half * EIGHTHS + 2, np.int32)
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
                c = float(self.entry[e, 2])
                s = float(self.entry[e, 3])
                turns = 0
                for turn in range(EIGHTHS):
                    if c * self.middle[turn, 0] + s * self.middle[turn, 1] >= self.least:
                        in_reach[turns] = turn
                        turns += 1
                u = float(self.entry[e, 0])
                v = float(self.entry[e, 1])
                reach = float(self.entry[e, 4])
                reach = reach if reach > LEAST_PRECISION else LEAST_PRECISION
                reach = self.slack / sqrt(reach) * 1.001 + 0.01
                for row in range(self._line(v - reach), self._line(v + reach) + 1):
                    for column in range(self._line(u - reach), self._line(u + reach) + 1):
                        for turn in range(turns):
                            cell = (row * 2 * self.half + column) * EIGHTHS + in_reach[turn]
                            if filling:
                                self.item[self.start[cell + 1]] = e
                            self.start[cell + 2 - filling] += 1
        cells = 4 * self.half * self.half * EIGHTHS
        if not filling:
            for cell in range(cells):
                self.start[cell + 2] += self.start[cell + 1]
        return self.start[cells + 1 - filling]

    def _line(self, place):
        """Return the row or column of cells of a coordinate."""
        place = place * self.per_px + self.half
        if not place > 0.0:
            return 0
        if place >= 2 * self.half:
            return 2 * self.half - 1
        return int(place)

    def to_prints(self, count, frame, minutiae, min_cosine, similarity, before):
        """Fill ``similarity[i, j]`` for the minutiae i of print A and j of print B.

        The indexed print is B, and the other comes `before` it, or it is A. `count` and `frame`
        belong to the other, of which the first `minutiae` are compared.
        """
        if before:
            return _compare(self, count, frame, minutiae, min_cosine, similarity, True)
        return _compare(self, count, frame, minutiae, min_cosine, similarity, False)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
@cython.locals(k=cython.Py_ssize_t, at=cython.Py_ssize_t, e=cython.Py_ssize_t)
@cython.locals(precision=cython.double, weight=cython.double)
def _compare(
    index: NeighbourIndex,
    count: cython.int[::1],
    frame: cython.float[:, :, ::1],
    minutiae: cython.Py_ssize_t,
    min_cosine: cython.double,
    similarity: cython.float[:, ::1],
    before: cython.bint,
) -> cython.int:
    """Do as `to_prints` says, inlined once for either order.

    A neighbour in A counts by the most similar one in B.
    """
    scale = 0.25 / (1.0 - min_cosine)  # `_agreement` doubles either factor
    n = index.minutiae
    entry, owner, item, start = index.entry, index.owner, index.item, index.start
    best, total, root_weight = index.best, index.total, index.root_weight
    for i in range(minutiae):
        for k in range(count[i]):
            u = float(frame[i, 0, k])
            v = float(frame[i, 1, k])
            c = float(frame[i, 2, k])
            s = float(frame[i, 3, k])
            precision = float(frame[i, 4, k])
            weight = float(frame[i, 5, k])
            cell = index._line(v) * 2 * index.half + index._line(u)
            cell = cell * EIGHTHS + eighth(c, s)
            for at in range(start[cell], start[cell + 1]):
                e = item[at]
                if before:
                    weight = entry[e, 5]
                else:
                    precision = entry[e, 4]
                near = _agreement(entry, e, u, v, c, s, min_cosine, scale, precision) * weight
                if before:
                    e = k * n + owner[e]
                best[e] = near if near > best[e] else best[e]
        for k in range(count[i] if before else index.size):
            weight = float(frame[i, 5, k]) if before else 0.0
            for j in range(n):
                e = k * n + j
                total[j] += best[e] * (weight if before else root_weight[e])
                best[e] = 0.0
        for j in range(n):
            if before:
                similarity[i, j] = total[j]
            else:
                similarity[j, i] = total[j]
            total[j] = 0.0
    return 0


def normalize_by_size(similarity, count_a, minutiae_a, count_b, minutiae_b, fewest):
    """Divide by the geometric mean of the neighbourhoods' sizes, each at least `fewest`."""
    for i in range(minutiae_a):
        share = _inverse_root(count_a[i], fewest)
        for j in range(minutiae_b):
            raw = float(similarity[i, j])
            similarity[i, j] = raw * (share * _inverse_root(count_b[j], fewest))
    return 0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _inverse_root(count: cython.int, fewest: cython.int) -> cython.double:
    """Return 1/√count, with a count of at least `fewest`."""
    count = count if count > fewest else fewest
    return INVERSE_ROOT[count] if count < ROOTS else 1.0 / sqrt(count)

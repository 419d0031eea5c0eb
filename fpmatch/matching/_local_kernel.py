"""Kernel: the local similarity of every minutia of one print to every minutia of the other.

A neighbour is described in the frame of its minutia, whose direction is +u: by its position (u, v)
and its relative direction (c, s). The similarity of two neighbours decreases with their distance,
relative to a tolerance that grows with the distance from the minutia, and with their difference in
direction. Each neighbour of print A counts by the most similar neighbour in B, or not at all:
neighbours may be missing or spurious in either print.

The neighbours of one print are sorted once into cells of position and direction; each cell lists
all neighbours that may be similar to one in it. Those of other prints are looked up there.
Interpreted, the kernel gives the same results to the last bit.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.libc.math import fabs, sqrt
else:
    from math import fabs, sqrt

COMPILED = cython.compiled

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
    entry: cython.float[:, ::1],
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
    du: cython.double = u - cython.cast(cython.double, entry[e, 0])
    dv: cython.double = v - cython.cast(cython.double, entry[e, 1])
    near: cython.double = 1.0 - (du * du + dv * dv) * precision
    turn: cython.double = (
        c * cython.cast(cython.double, entry[e, 2])
        + s * cython.cast(cython.double, entry[e, 3])
        - min_cosine
    ) * scale
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

    @cython.locals(
        count=cython.int[::1],
        frame=cython.float[:, :, ::1],
        side=cython.double,
        half=cython.Py_ssize_t,
        max_turn=cython.double,
        slack=cython.double,
        i=cython.Py_ssize_t,
        k=cython.Py_ssize_t,
        e=cython.Py_ssize_t,
        row=cython.Py_ssize_t,
        column=cython.Py_ssize_t,
        low_row=cython.Py_ssize_t,
        high_row=cython.Py_ssize_t,
        low_column=cython.Py_ssize_t,
        high_column=cython.Py_ssize_t,
        turn=cython.Py_ssize_t,
        turns=cython.Py_ssize_t,
        cell=cython.Py_ssize_t,
        cells=cython.Py_ssize_t,
        filling=cython.int,
        u=cython.double,
        v=cython.double,
        c=cython.double,
        s=cython.double,
        reach=cython.double,
        least=cython.double,
        middle=cython.double[:, ::1],
        in_reach=cython.Py_ssize_t[::1],
        entry=cython.float[:, ::1],
        owner=cython.int[::1],
        start=cython.int[::1],
        item=cython.int[::1],
    )
    def __init__(self, count, frame, side, half, max_turn, slack, other_size):
        self.minutiae = count.shape[0]
        self.size = frame.shape[2]
        self.half = half
        self.per_px = 1.0 / side
        self.best = np.zeros(self.minutiae * max(self.size, other_size))
        self.root_weight = np.asarray(frame)[:, 5].T.astype(np.float64).ravel()
        # single precision like the frames: half the memory
        entry = np.empty((self.minutiae * self.size, 6), np.float32)
        owner = np.empty(self.minutiae * self.size, np.int32)
        cells = 4 * half * half * EIGHTHS
        start = np.zeros(cells + 1, np.int32)
        item = np.empty(0, np.int32)
        middle = np.array([_middle_of(turn) for turn in range(EIGHTHS)])
        in_reach = np.empty(EIGHTHS, np.intp)
        least = np.cos(min(max_turn + np.pi / 8 + 1e-3, np.pi))
        for filling in range(2):
            for i in range(self.minutiae):
                for k in range(count[i]):
                    e = k * self.minutiae + i
                    for row in range(6):
                        entry[e, row] = frame[i, row, k]
                    owner[e] = cython.cast(cython.int, i)
                    turns = 0
                    for turn in range(EIGHTHS):
                        c = cython.cast(cython.double, entry[e, 2])
                        s = cython.cast(cython.double, entry[e, 3])
                        if c * middle[turn, 0] + s * middle[turn, 1] >= least:
                            in_reach[turns] = turn
                            turns += 1
                    u = cython.cast(cython.double, entry[e, 0])
                    v = cython.cast(cython.double, entry[e, 1])
                    reach = cython.cast(cython.double, entry[e, 4])
                    reach = reach if reach > LEAST_PRECISION else LEAST_PRECISION
                    reach = slack / sqrt(reach) * 1.001 + 0.01
                    low_column = self._line(u - reach)
                    high_column = self._line(u + reach)
                    low_row = self._line(v - reach)
                    high_row = self._line(v + reach)
                    for row in range(low_row, high_row + 1):
                        for column in range(low_column, high_column + 1):
                            for turn in range(turns):
                                cell = (row * 2 * half + column) * EIGHTHS + in_reach[turn]
                                if filling:
                                    item[start[cell]] = cython.cast(cython.int, e)
                                start[cell] += 1
            if not filling:
                # counts become starts, which advance while the cells are filled
                k = 0
                for cell in range(cells):
                    i = start[cell]
                    start[cell] = cython.cast(cython.int, k)
                    k += i
                start[cells] = cython.cast(cython.int, k)
                item = np.empty(k, np.int32)
        for cell in range(cells - 1, 0, -1):
            start[cell] = start[cell - 1]
        start[0] = 0
        self.entry = entry
        self.owner = owner
        self.start = start
        self.item = item

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def _line(self, place: cython.double) -> cython.Py_ssize_t:
        """Return the row or column of cells of a coordinate."""
        place = place * self.per_px + self.half
        if not place > 0.0:
            return 0
        if place >= 2 * self.half:
            return 2 * self.half - 1
        return cython.cast(cython.Py_ssize_t, place)

    def to_prints_before(self, count, frame, minutiae, min_cosine, similarity):
        """Fill ``similarity[i, j]`` for the minutiae i of another print A and j of the indexed one.

        `count` and `frame` are those of A, of which the first `minutiae` are compared.
        """
        scale = 0.25 / (1.0 - min_cosine)  # `_agreement` doubles either factor
        n = self.minutiae
        entry = self.entry
        owner = self.owner
        item = self.item
        best = self.best
        for i in range(minutiae):
            for k in range(count[i]):
                u = cython.cast(cython.double, frame[i, 0, k])
                v = cython.cast(cython.double, frame[i, 1, k])
                c = cython.cast(cython.double, frame[i, 2, k])
                s = cython.cast(cython.double, frame[i, 3, k])
                precision = cython.cast(cython.double, frame[i, 4, k])
                cell = self._line(v) * 2 * self.half + self._line(u)
                cell = cell * EIGHTHS + eighth(c, s)
                for at in range(self.start[cell], self.start[cell + 1]):
                    e = item[at]
                    weight = cython.cast(cython.double, entry[e, 5])
                    near = _agreement(entry, e, u, v, c, s, min_cosine, scale, precision) * weight
                    j = k * n + owner[e]
                    best[j] = near if near > best[j] else best[j]
            j = 0
            while j + 4 <= n:  # four at a time, whose sums stay in registers
                t0 = t1 = t2 = t3 = 0.0
                for k in range(count[i]):
                    weight = cython.cast(cython.double, frame[i, 5, k])
                    e = k * n + j
                    t0 += best[e] * weight
                    t1 += best[e + 1] * weight
                    t2 += best[e + 2] * weight
                    t3 += best[e + 3] * weight
                    best[e] = 0.0
                    best[e + 1] = 0.0
                    best[e + 2] = 0.0
                    best[e + 3] = 0.0
                similarity[i, j] = cython.cast(cython.float, t0)
                similarity[i, j + 1] = cython.cast(cython.float, t1)
                similarity[i, j + 2] = cython.cast(cython.float, t2)
                similarity[i, j + 3] = cython.cast(cython.float, t3)
                j += 4
            while j < n:
                t0 = 0.0
                for k in range(count[i]):
                    t0 += best[k * n + j] * cython.cast(cython.double, frame[i, 5, k])
                    best[k * n + j] = 0.0
                similarity[i, j] = cython.cast(cython.float, t0)
                j += 1
        return 0

    def to_prints_after(self, count, frame, minutiae, min_cosine, similarity):
        """Fill ``similarity[i, j]`` for the minutiae i of the indexed print and j of another, B.

        `count` and `frame` are those of B, of which the first `minutiae` are compared.
        """
        scale = 0.25 / (1.0 - min_cosine)  # `_agreement` doubles either factor
        n = self.minutiae
        entry = self.entry
        item = self.item
        root_weight = self.root_weight
        best = self.best
        for j in range(minutiae):
            for m in range(count[j]):
                u = cython.cast(cython.double, frame[j, 0, m])
                v = cython.cast(cython.double, frame[j, 1, m])
                c = cython.cast(cython.double, frame[j, 2, m])
                s = cython.cast(cython.double, frame[j, 3, m])
                weight = cython.cast(cython.double, frame[j, 5, m])
                cell = self._line(v) * 2 * self.half + self._line(u)
                cell = cell * EIGHTHS + eighth(c, s)
                for at in range(self.start[cell], self.start[cell + 1]):
                    e = item[at]
                    precision = cython.cast(cython.double, entry[e, 4])
                    near = _agreement(entry, e, u, v, c, s, min_cosine, scale, precision) * weight
                    best[e] = near if near > best[e] else best[e]
            i = 0
            while i + 4 <= n:  # four at a time, whose sums stay in registers
                t0 = t1 = t2 = t3 = 0.0
                for k in range(self.size):
                    e = k * n + i
                    t0 += best[e] * root_weight[e]
                    t1 += best[e + 1] * root_weight[e + 1]
                    t2 += best[e + 2] * root_weight[e + 2]
                    t3 += best[e + 3] * root_weight[e + 3]
                    best[e] = 0.0
                    best[e + 1] = 0.0
                    best[e + 2] = 0.0
                    best[e + 3] = 0.0
                similarity[i, j] = cython.cast(cython.float, t0)
                similarity[i + 1, j] = cython.cast(cython.float, t1)
                similarity[i + 2, j] = cython.cast(cython.float, t2)
                similarity[i + 3, j] = cython.cast(cython.float, t3)
                i += 4
            while i < n:
                t0 = 0.0
                for k in range(self.size):
                    t0 += best[k * n + i] * root_weight[k * n + i]
                    best[k * n + i] = 0.0
                similarity[i, j] = cython.cast(cython.float, t0)
                i += 1
        return 0


def normalize_by_size(similarity, count_a, minutiae_a, count_b, minutiae_b, fewest):
    """Divide by the geometric mean of the neighbourhoods' sizes, each at least `fewest`."""
    for i in range(minutiae_a):
        share = _inverse_root(count_a[i], fewest)
        for j in range(minutiae_b):
            similarity[i, j] = cython.cast(
                cython.float,
                cython.cast(cython.double, similarity[i, j])
                * (share * _inverse_root(count_b[j], fewest)),
            )
    return 0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _inverse_root(count: cython.int, fewest: cython.int) -> cython.double:
    """Return 1/√count, with a count of at least `fewest`."""
    count = count if count > fewest else fewest
    return INVERSE_ROOT[count] if count < ROOTS else 1.0 / sqrt(count)

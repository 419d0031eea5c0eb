# mypy: ignore-errors
"""Kernel: the local similarity of every minutia of one print to every minutia of the other.

A neighbour is described in the frame of its minutia, whose direction is +u: by its position (u, v)
and its relative direction (c, s). The similarity of two neighbours decreases with their distance,
relative to a tolerance that grows with the distance from the minutia, and with their difference in
direction. Each neighbour of print A counts by the most similar neighbour in B, or not at all:
neighbours may be missing or spurious in either print.

The neighbours of one print are numbered. For each of the four numbers that describe a neighbour, a
table has a set of bits for each bin: the neighbours that may be similar to one in it. Neighbours of
other prints are looked up there: the sets of the four bins have few in common.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.prints._kernels._bits import lowest_place
from cython.cimports.libc.math import fabs, sqrt

BINS = cython.declare(cython.Py_ssize_t, 64)  # of u, of v, of c and of s
BIN_PX = cython.declare(cython.double, 5.0)  # of a position; both set the time it takes, no more
ONE = cython.declare(cython.ulonglong, 1)
LAST = cython.declare(cython.ulonglong, 1 << 63)
# least 1/tolerance² of very distant neighbours, where it would underflow
LEAST_PRECISION = cython.declare(cython.double, 1e-30)


@cython.final
@cython.cclass
class NeighbourIndex:
    """The neighbours of one print's minutiae, in sets by position and direction.

    ``frame[i, :, k]`` holds, for neighbour k of minutia i: u, v, c, s, 1/tolerance², weight. Its
    number is ``k * minutiae + i``. Of 64 bins of each of u, v, c and s, the outermost are
    unbounded. A neighbour is in the sets of all bins within its own tolerance times a slack and an
    angle of the largest difference in direction. With a slack of 1/(1 - growth) it is found also
    where the tolerance of the other print is used, which grows likewise with the distance. Other
    prints have at most as many neighbours for each minutia.
    """

    def __init__(self, count, frame, parameters) -> None:
        p = parameters
        self.minutiae, _, self.size = frame.shape
        numbers = self.minutiae * self.size
        words = (numbers + 63) >> 6  # of a set: 64 bits each
        self.fewest, self.min_cosine = p.fewest_neighbours, p.neighbour_cosine
        self.share = 1.0 / np.sqrt(np.maximum(count, self.fewest))
        entry = np.asarray(frame, np.float64).transpose(2, 0, 1).reshape(numbers, 6)
        self.entry = np.ascontiguousarray(entry)
        self.owner = np.tile(np.arange(self.minutiae, dtype=np.int32), self.size)
        self.scale = np.array([1.0 / BIN_PX, 1.0 / BIN_PX, 0.25 * BINS, 0.25 * BINS])
        self.near = np.zeros((4, BINS, words), np.uint64)
        self.touched = np.zeros(words, np.uint64)
        self.word = np.zeros(self.size * words + 1, np.uint64)
        self.place = np.zeros(self.size * words + 1, np.int32)
        self.number = np.zeros(64 * self.size * words + 1, np.int32)
        self.best, self.total = np.zeros(numbers), np.zeros(self.minutiae)
        turn = min(np.arccos(p.neighbour_cosine) + 1e-3, np.pi)
        self._list(count, frame, 1.0 / (1.0 - p.tolerance_per_px), np.cos(turn), np.sin(turn))

    @cython.locals(k=cython.Py_ssize_t, axis=cython.Py_ssize_t)
    def _list(self, count, frame, slack, c, s):
        """Put the neighbours into the sets; c, s: cosine and sine of the largest difference."""
        for i in range(self.minutiae):
            for k in range(count[i]):
                e = k * self.minutiae + i
                entry = cython.address(self.entry[e, 0])
                reach = slack / sqrt(max(entry[4], LEAST_PRECISION)) * 1.001 + 0.01
                for axis in range(4):
                    low, high = entry[axis] - reach, entry[axis] + reach
                    if axis > 1:
                        # of the arc of directions around the neighbour's, which may contain ±1
                        middle, half = entry[axis] * c, fabs(entry[5 - axis]) * s
                        low = middle - half if -entry[axis] < c else -1.0
                        high = middle + half if entry[axis] < c else 1.0
                    for at in range(self._bin(axis, low), self._bin(axis, high) + 1):
                        self.near[axis, at, e >> 6] |= ONE << (e & 63)
        return 0

    def _bin(self, axis, value):
        """Return the bin of a value of u, v, c or s."""
        value = value * self.scale[axis] + 0.5 * BINS
        if not value > 0.0:
            return 0
        return int(value) if value < BINS else BINS - 1

    @cython.locals(k=cython.Py_ssize_t, e=cython.Py_ssize_t, at=cython.Py_ssize_t)
    @cython.locals(bits=cython.ulonglong, found=cython.Py_ssize_t)
    def to_prints(self, count, frame, minutiae, similarity, before):
        """Fill ``similarity[i, j]`` for the minutiae i of print A and j of print B.

        The print of the index is B, and the other comes `before` it, or it is A. `count` and
        `frame` belong to the other, of which the first `minutiae` are compared. Similarities are
        divided by the geometric mean of the neighbourhoods' sizes, each at least `fewest`. A
        neighbour in A counts by the most similar one in B.
        """
        n, min_cosine = self.minutiae, self.min_cosine
        scale = 0.25 / (1.0 - min_cosine)  # either factor below is doubled
        words = self.touched.shape[0]
        touched = cython.address(self.touched[0])
        word, place = cython.address(self.word[0]), cython.address(self.place[0])
        number, owner = cython.address(self.number[0]), cython.address(self.owner[0])
        best, total = cython.address(self.best[0]), cython.address(self.total[0])
        for i in range(minutiae):
            found = 0
            for k in range(count[i]):
                by_u = cython.address(self.near[0, self._bin(0, frame[i, 0, k]), 0])
                by_v = cython.address(self.near[1, self._bin(1, frame[i, 1, k]), 0])
                by_c = cython.address(self.near[2, self._bin(2, frame[i, 2, k]), 0])
                by_s = cython.address(self.near[3, self._bin(3, frame[i, 3, k]), 0])
                for at in range(words):
                    bits = by_u[at] & by_v[at] & by_c[at] & by_s[at]
                    word[found], place[found] = bits, k << 16 | at << 6
                    found += bits != 0
            for m in range(self._unpack(found)):
                k, e = number[m] >> 16, number[m] & 0xFFFF
                entry = cython.address(self.entry[e, 0])
                precision = float(frame[i, 4, k]) if before else entry[4]
                weight_a = float(frame[i, 5, k]) if before else entry[5]
                weight_b = entry[5] if before else float(frame[i, 5, k])
                du = float(frame[i, 0, k]) - entry[0]
                dv = float(frame[i, 1, k]) - entry[1]
                value = 1.0 - (du * du + dv * dv) * precision
                turn = float(frame[i, 2, k]) * entry[2] + float(frame[i, 3, k]) * entry[3]
                turn = (turn - min_cosine) * scale
                # twice each value, or 0 where it is negative, without a branch
                value = (value + fabs(value)) * (turn + fabs(turn)) * weight_b * weight_a
                if before:
                    e = k * n + owner[e]
                touched[e >> 6] |= ONE << (e & 63)
                # a value of its own: the compiler then takes the maximum without a branch
                most = best[e]
                best[e] = value if value > most else most
            # by A's neighbours, in turn
            found = 0
            for at in range(words):
                word[found], place[found] = touched[at], at << 6
                found += touched[at] != 0
                touched[at] = 0
            for m in range(self._unpack(found)):
                e = number[m]
                total[owner[e]] += best[e]
                best[e] = 0.0
            share = 1.0 / sqrt(max(count[i], self.fewest))
            for e in range(n):
                raw: cython.float = total[e]
                if before:
                    similarity[i, e] = raw * (share * self.share[e])
                else:
                    similarity[e, i] = raw * (share * self.share[e])
                total[e] = 0.0
        return 0

    @cython.locals(k=cython.Py_ssize_t, unpacked=cython.Py_ssize_t, bits=cython.ulonglong)
    def _unpack(self, found):
        """Write the numbers of the bits of the words found; return how many they are."""
        word, place = cython.address(self.word[0]), cython.address(self.place[0])
        number = cython.address(self.number[0])
        unpacked = 0
        for k in range(found):
            bits = word[k]
            number[unpacked] = place[k] + lowest_place(bits)
            bits &= bits - 1
            # few have more than two: no branch for the second, which would be mispredicted often
            number[unpacked + 1] = place[k] + lowest_place(bits | LAST)
            unpacked += 1 + (bits != 0)
            bits &= bits - 1
            while bits:
                number[unpacked] = place[k] + lowest_place(bits)
                unpacked += 1
                bits &= bits - 1
        return unpacked

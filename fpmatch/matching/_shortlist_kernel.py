"""Kernel: which of many prints may be of one print's finger, told from codes in passing.

Each minutia has twelve words for its neighbours, each the cell of position and direction, in the
minutia's own frame, in which one lies, and twelve for the ridge orientation at places around it.
A print that is looked for is put into tables first: under each word, a bit for each of its
minutiae that has such a neighbour, or such an orientation there. So a minutia of another print is
compared with all of them at once: the bits under its words are counted, all minutiae side by
side. Minutiae that agree in enough are pairs; a print counts by its pairs that one rotation and
one shift explain. Interpreted, it runs as it stands; its oracle in the tests is written in numpy.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.libc.math import sqrt
else:
    from math import sqrt

COMPILED = cython.compiled

WORDS = cython.declare(cython.int, 12)  # of neighbours, and as many of orientations
ROOM = cython.declare(cython.int, 64)  # minutiae of the print that is looked for: bits of a word
SECTORS = cython.declare(cython.int, 16)  # of relative direction, in a turn
BINS = cython.declare(cython.int, 16)  # of relative orientation, in half a turn
ORIENTATIONS = cython.declare(cython.int, 255)  # codes of a cell's orientation, from 1 on
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)
# Times a single bit, its highest six bits say which: they are different for all 64.
WHICH = cython.declare(cython.ulonglong, 0x03F79D71B4CB0A89)
MOST_WEIGHT = cython.declare(cython.int, 31)


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.exceptval(check=False)
def code_neighbours(
    start: cython.const[cython.longlong][::1],
    xy: cython.const[cython.float][:, ::1],
    direction: cython.const[cython.float][:, ::1],
    turn: cython.const[cython.uchar][::1],
    count: cython.const[cython.uchar][::1],
    neighbour: cython.const[cython.uchar][:, ::1],
    per_px: cython.double,
    half: cython.int,
    word: cython.ushort[:, ::1],
) -> cython.int:
    """Fill `word` for the minutiae of prints that begin at the entries `start`.

    The cells are squares of ``1 / per_px`` pixels, `half` of them from the middle to each border,
    times sectors of direction; beyond the border, and where there is no neighbour, the word is the
    one after all cells.
    """
    t: cython.Py_ssize_t
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    dx: cython.double
    dy: cython.double
    u: cython.double
    v: cython.double
    c: cython.double
    s: cython.double
    side: cython.int = 2 * half
    none: cython.int = side * side * SECTORS
    sector: cython.int
    for t in range(start.shape[0] - 1):
        for i in range(start[t], start[t + 1]):
            c = cython.cast(cython.double, direction[i, 0])
            s = cython.cast(cython.double, direction[i, 1])
            for k in range(WORDS):
                word[i, k] = none
            for k in range(count[i]):
                j = start[t] + neighbour[i, k]
                dx = cython.cast(cython.double, xy[j, 0]) - cython.cast(cython.double, xy[i, 0])
                dy = cython.cast(cython.double, xy[j, 1]) - cython.cast(cython.double, xy[i, 1])
                u = (c * dx + s * dy) * per_px + half
                v = (c * dy - s * dx) * per_px + half
                if 0.0 <= u < side and 0.0 <= v < side:
                    sector = cython.cast(cython.int, turn[j]) - cython.cast(cython.int, turn[i])
                    sector = ((sector + 256) & 255) >> 4
                    word[i, k] = (
                        cython.cast(cython.int, v) * side + cython.cast(cython.int, u)
                    ) * SECTORS + sector
    return 0


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def code_flow(
    start: cython.const[cython.longlong][::1],
    xy: cython.const[cython.float][:, ::1],
    direction: cython.const[cython.float][:, ::1],
    turn: cython.const[cython.uchar][::1],
    cell: cython.const[cython.uchar][::1],
    cell_start: cython.const[cython.longlong][::1],
    shape: cython.const[cython.int][:, ::1],
    step: cython.const[cython.double][::1],
    has_flow: cython.const[cython.uchar][::1],
    places: cython.double[:, ::1],
    word: cython.uchar[:, ::1],
) -> cython.int:
    """Fill `word` with the ridge orientation at `places`, in each minutia's own frame.

    A word is ``BINS * place + bin``, or the one after all of them where the orientation is not
    known.
    """
    t: cython.Py_ssize_t
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t
    x: cython.double
    y: cython.double
    c: cython.double
    s: cython.double
    relative: cython.double
    code: cython.int
    for t in range(start.shape[0] - 1):
        for i in range(start[t], start[t + 1]):
            c = cython.cast(cython.double, direction[i, 0])
            s = cython.cast(cython.double, direction[i, 1])
            for k in range(WORDS):
                word[i, k] = cython.cast(cython.uchar, WORDS * BINS)
                if not has_flow[t]:
                    continue
                x = (xy[i, 0] + c * places[0, k] - s * places[1, k]) / step[t] - shape[t, 3]
                y = -(xy[i, 1] + s * places[0, k] + c * places[1, k]) / step[t] - shape[t, 2]
                if not (0.0 <= x < shape[t, 1] and 0.0 <= y < shape[t, 0]):
                    continue
                code = cell[
                    cell_start[t]
                    + cython.cast(cython.Py_ssize_t, y) * shape[t, 1]
                    + cython.cast(cython.Py_ssize_t, x)
                ]
                if code > 0:
                    # in bins: a turn is 256 steps of direction, half a turn 255 of orientation
                    relative = (code - 1.0) * BINS / ORIENTATIONS - turn[i] * (2.0 * BINS / 256.0)
                    while relative < 0.0:
                        relative += BINS
                    code = cython.cast(cython.int, relative)
                    code = code if code < BINS else BINS - 1
                    word[i, k] = cython.cast(cython.uchar, BINS * k + code)
    return 0


@cython.final
@cython.cclass
class Sieve:
    """One print in tables, and the room in which others are compared with it by their codes.

    `count`, `frame`, `xy` and `turn` are those of its minutiae, 64 at most: number of neighbours,
    their positions, directions and tolerances, place, and direction in 256ths of a turn; `flow` is
    the orientation at its places in bins, negative where unknown. `cells` gives cells a pixel and
    how many lie from the middle to the border; `reach` how far, as a share of the tolerance, and
    `cosine` how directed the middle of a cell may be from a neighbour; `bins` how many bins an
    orientation may differ.
    """

    def __init__(
        self, count, frame, xy, turn, flow, cells, reach, cosine, bins, parameters
    ) -> None:
        per_px, half = cells
        self.minutiae = count.shape[0]
        self.xy = xy
        self.turn = turn
        self.has_flow = bool((np.asarray(flow) >= 0).any())
        self.around = np.zeros(4 * half * half * SECTORS + 1, np.uint64)
        self.along = np.zeros(WORDS * BINS + 1, np.uint64)
        angle = np.arange(256) * (2 * np.pi / 256)
        self.cosine_of = np.cos(angle)
        self.sine_of = np.sin(angle)
        which = np.zeros(64, np.uint8)
        for k in range(64):
            which[((int(WHICH) << k) & 0xFFFFFFFFFFFFFFFF) >> 58] = k
        self.which = which
        self.ones = self.twos = self.fours = self.eights = 0
        self.most = parameters.most_pairs
        room = ROOM * 256
        self.own = np.zeros(room, np.int32)
        self.other = np.zeros(room, np.int32)
        self.weight = np.zeros(room, np.int32)
        self.angle = np.zeros(self.most, np.int32)
        self.x = np.zeros((2, self.most))
        self.y = np.zeros((2, self.most))
        self.near = parameters.near_px
        self.spread = parameters.spread
        self.most_turn = parameters.most_turn
        self._enter_neighbours(count, frame, per_px, half, reach, cosine)
        self._enter_flow(flow, bins)

    @cython.cfunc
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _enter_neighbours(
        self,
        count: cython.int[::1],
        frame: cython.float[:, :, ::1],
        per_px: cython.double,
        half: cython.int,
        reach: cython.double,
        cosine: cython.double,
    ) -> cython.int:
        """Set the bits of all minutiae under the words that a neighbour of theirs may have."""
        i: cython.Py_ssize_t
        k: cython.Py_ssize_t
        row: cython.int
        column: cython.int
        sector: cython.int
        at: cython.Py_ssize_t
        side: cython.int = 2 * half
        u: cython.double
        v: cython.double
        r: cython.double
        dx: cython.double
        dy: cython.double
        first_row: cython.int
        last_row: cython.int
        first_column: cython.int
        last_column: cython.int
        bit: cython.ulonglong
        middle: cython.int
        for i in range(self.minutiae):
            bit = (ONE << i) & ALL
            for k in range(count[i]):
                u = cython.cast(cython.double, frame[i, 0, k]) * per_px + half
                v = cython.cast(cython.double, frame[i, 1, k]) * per_px + half
                r = reach * per_px / sqrt(cython.cast(cython.double, frame[i, 4, k]))
                if not (-r <= u <= side + r and -r <= v <= side + r):
                    continue
                first_column = self._line(u - r, side)
                last_column = self._line(u + r, side)
                first_row = self._line(v - r, side)
                last_row = self._line(v + r, side)
                for row in range(first_row, last_row + 1):
                    dy = row + 0.5 - v
                    for column in range(first_column, last_column + 1):
                        dx = column + 0.5 - u
                        if dx * dx + dy * dy > r * r:
                            continue
                        at = (row * side + column) * SECTORS
                        for sector in range(SECTORS):
                            middle = 256 // SECTORS * sector + 128 // SECTORS
                            if (
                                self.cosine_of[middle] * frame[i, 2, k]
                                + self.sine_of[middle] * frame[i, 3, k]
                                >= cosine
                            ):
                                self.around[at + sector] |= bit
        return 0

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def _line(self, place: cython.double, side: cython.int) -> cython.int:
        """Return the row or column of cells of a coordinate, the nearest where it has none."""
        if not place > 0.0:
            return 0
        if place >= side:
            return side - 1
        return cython.cast(cython.int, place)

    @cython.cfunc
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _enter_flow(self, flow: cython.double[:, ::1], bins: cython.double) -> cython.int:
        """Set the bits of all minutiae under the words that an orientation of theirs may have."""
        i: cython.Py_ssize_t
        k: cython.Py_ssize_t
        b: cython.int
        apart: cython.double
        for i in range(self.minutiae):
            for k in range(WORDS):
                if flow[i, k] < 0.0:
                    continue
                for b in range(BINS):
                    apart = b + 0.5 - flow[i, k]
                    apart = apart if apart >= 0.0 else -apart
                    apart = apart if apart <= BINS - apart else BINS - apart
                    if apart <= bins:
                        self.along[BINS * k + b] |= (ONE << i) & ALL
        return 0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def weigh(
        self,
        first: cython.Py_ssize_t,
        start: cython.const[cython.longlong][::1],
        xy: cython.const[cython.float][:, ::1],
        turn: cython.const[cython.uchar][::1],
        around: cython.const[cython.ushort][:, ::1],
        along: cython.const[cython.uchar][:, ::1],
        has_flow: cython.const[cython.uchar][::1],
        score: cython.int[::1],
    ) -> cython.int:
        """Fill `score` for as many prints, from the print `first` on."""
        t: cython.Py_ssize_t
        pairs: cython.int
        for t in range(score.shape[0]):
            pairs = self._pair(
                start[first + t], start[first + t + 1], around, along, has_flow[first + t]
            )
            pairs = self._best_of(pairs)
            score[t] = self._explained(pairs, start[first + t], xy, turn)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _pair(
        self,
        first: cython.longlong,
        last: cython.longlong,
        around: cython.const[cython.ushort][:, ::1],
        along: cython.const[cython.uchar][:, ::1],
        has_flow: cython.bint,
    ) -> cython.int:
        """Gather the pairs of minutiae that agree in enough; return their number.

        One that agrees in n neighbours and f orientations weighs ``4 n + f - 15``, 18 at most:
        about twice the logarithm of how much likelier it is among prints of one finger. Where
        orientations are unknown, six are taken to agree.
        """
        j: cython.longlong
        found: cython.int = 0
        weight: cython.int
        any_: cython.ulonglong
        lowest: cython.ulonglong
        place: cython.Py_ssize_t
        n1: cython.ulonglong
        n2: cython.ulonglong
        n4: cython.ulonglong
        n8: cython.ulonglong
        f1: cython.ulonglong
        f2: cython.ulonglong
        f4: cython.ulonglong
        f8: cython.ulonglong
        flowing: cython.bint = has_flow and self.has_flow
        for j in range(first, last):
            self._count(
                self.around[around[j, 0]],
                self.around[around[j, 1]],
                self.around[around[j, 2]],
                self.around[around[j, 3]],
                self.around[around[j, 4]],
                self.around[around[j, 5]],
                self.around[around[j, 6]],
                self.around[around[j, 7]],
                self.around[around[j, 8]],
                self.around[around[j, 9]],
                self.around[around[j, 10]],
                self.around[around[j, 11]],
            )
            n1 = cython.cast(cython.ulonglong, self.ones)
            n2 = cython.cast(cython.ulonglong, self.twos)
            n4 = cython.cast(cython.ulonglong, self.fours)
            n8 = cython.cast(cython.ulonglong, self.eights)
            any_ = n2 | n4 | n8
            if not any_:
                continue
            if flowing:
                self._count(
                    self.along[along[j, 0]],
                    self.along[along[j, 1]],
                    self.along[along[j, 2]],
                    self.along[along[j, 3]],
                    self.along[along[j, 4]],
                    self.along[along[j, 5]],
                    self.along[along[j, 6]],
                    self.along[along[j, 7]],
                    self.along[along[j, 8]],
                    self.along[along[j, 9]],
                    self.along[along[j, 10]],
                    self.along[along[j, 11]],
                )
                f1 = cython.cast(cython.ulonglong, self.ones)
                f2 = cython.cast(cython.ulonglong, self.twos)
                f4 = cython.cast(cython.ulonglong, self.fours)
                f8 = cython.cast(cython.ulonglong, self.eights)
            else:
                f1 = 0
                f2 = ALL
                f4 = ALL
                f8 = 0
            # what weighs anything: four neighbours; three and five orientations; two and nine
            any_ &= (n4 | n8) | (n1 & n2 & (f8 | (f4 & (f1 | f2)))) | (n2 & f8 & (f1 | f2 | f4))
            while any_:
                lowest = any_ & ((any_ ^ ALL) + 1)
                any_ ^= lowest
                place = cython.cast(cython.Py_ssize_t, self.which[((lowest * WHICH) & ALL) >> 58])
                weight = cython.cast(cython.int, (n1 >> place) & 1)
                weight += 2 * cython.cast(cython.int, (n2 >> place) & 1)
                weight += 4 * cython.cast(cython.int, (n4 >> place) & 1)
                weight += 8 * cython.cast(cython.int, (n8 >> place) & 1)
                weight = 4 * weight - 15
                weight += cython.cast(cython.int, (f1 >> place) & 1)
                weight += 2 * cython.cast(cython.int, (f2 >> place) & 1)
                weight += 4 * cython.cast(cython.int, (f4 >> place) & 1)
                weight += 8 * cython.cast(cython.int, (f8 >> place) & 1)
                self.own[found] = cython.cast(cython.int, place)
                self.other[found] = cython.cast(cython.int, j - first)
                self.weight[found] = weight if weight < 18 else 18
                found += 1
        return found

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def _count(
        self,
        a: cython.ulonglong,
        b: cython.ulonglong,
        c: cython.ulonglong,
        d: cython.ulonglong,
        e: cython.ulonglong,
        f: cython.ulonglong,
        g: cython.ulonglong,
        h: cython.ulonglong,
        i: cython.ulonglong,
        j: cython.ulonglong,
        k: cython.ulonglong,
        m: cython.ulonglong,
    ) -> cython.int:
        """Count, for each place of a bit, in how many of twelve it is set.

        Three are added at a time: what is odd remains, what carries is worth twice as much.
        """
        odd: cython.ulonglong
        odd_1: cython.ulonglong
        odd_2: cython.ulonglong
        odd_3: cython.ulonglong
        two_1: cython.ulonglong
        two_2: cython.ulonglong
        two_3: cython.ulonglong
        two_4: cython.ulonglong
        two_5: cython.ulonglong
        two_6: cython.ulonglong
        four_1: cython.ulonglong
        four_2: cython.ulonglong
        four_3: cython.ulonglong
        odd = a ^ b
        odd_1 = odd ^ c
        two_1 = (a & b) | (odd & c)
        odd = d ^ e
        odd_2 = odd ^ f
        two_2 = (d & e) | (odd & f)
        odd = g ^ h
        odd_3 = odd ^ i
        two_3 = (g & h) | (odd & i)
        odd = odd_1 ^ odd_2
        two_4 = (odd_1 & odd_2) | (odd & odd_3)
        odd_1 = odd ^ odd_3
        odd = j ^ k
        odd_2 = odd ^ m
        two_5 = (j & k) | (odd & m)
        self.ones = odd_1 ^ odd_2
        two_6 = odd_1 & odd_2
        odd = two_1 ^ two_2
        odd_1 = odd ^ two_3
        four_1 = (two_1 & two_2) | (odd & two_3)
        odd = two_4 ^ two_5
        odd_2 = odd ^ two_6
        four_2 = (two_4 & two_5) | (odd & two_6)
        self.twos = odd_1 ^ odd_2
        four_3 = odd_1 & odd_2
        odd = four_1 ^ four_2
        self.fours = odd ^ four_3
        self.eights = (four_1 & four_2) | (odd & four_3)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _best_of(self, pairs: cython.int) -> cython.int:
        """Keep as many pairs as there may be, those that weigh most, the first of equals."""
        least: cython.int = MOST_WEIGHT
        above: cython.int = 0
        k: cython.int
        kept: cython.int = 0
        equal: cython.int
        if pairs <= self.most:
            return pairs
        while True:
            equal = 0
            for k in range(pairs):
                equal += self.weight[k] == least
            if above + equal >= self.most:
                break
            above += equal
            least -= 1
        equal = self.most - above
        for k in range(pairs):
            if self.weight[k] < least or (self.weight[k] == least and equal == 0):
                continue
            equal -= self.weight[k] == least
            self.own[kept] = self.own[k]
            self.other[kept] = self.other[k]
            self.weight[kept] = self.weight[k]
            kept += 1
        return kept

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _explained(
        self,
        pairs: cython.int,
        first: cython.longlong,
        xy: cython.const[cython.float][:, ::1],
        turn: cython.const[cython.uchar][::1],
    ) -> cython.int:
        """Return the greatest weight of pairs that the transform of one of them explains.

        Of the pairs of one minutia, of either print, the first that it explains counts.
        """
        g: cython.int
        h: cython.int
        best: cython.int = 0
        total: cython.int
        last: cython.int
        own: cython.int
        apart: cython.int
        used: cython.ulonglong
        c: cython.double
        s: cython.double
        dx: cython.double
        dy: cython.double
        ex: cython.double
        ey: cython.double
        reach: cython.double
        for h in range(pairs):
            self.angle[h] = (
                cython.cast(cython.int, self.turn[self.own[h]])
                - cython.cast(cython.int, turn[first + self.other[h]])
            ) & 255
            self.x[0, h] = self.xy[self.own[h], 0]
            self.y[0, h] = self.xy[self.own[h], 1]
            self.x[1, h] = xy[first + self.other[h], 0]
            self.y[1, h] = xy[first + self.other[h], 1]
        for h in range(pairs):
            c = self.cosine_of[self.angle[h]]
            s = self.sine_of[self.angle[h]]
            total = 0
            last = -1
            used = 0
            for g in range(pairs):
                apart = (self.angle[g] - self.angle[h] + 128) & 255
                if apart < 128 - self.most_turn or apart > 128 + self.most_turn:
                    continue
                dx = self.x[1, g] - self.x[1, h]
                dy = self.y[1, g] - self.y[1, h]
                ex = c * dx - s * dy - (self.x[0, g] - self.x[0, h])
                ey = s * dx + c * dy - (self.y[0, g] - self.y[0, h])
                reach = self.near + self.spread * sqrt(dx * dx + dy * dy)
                if ex * ex + ey * ey > reach * reach:
                    continue
                own = cython.cast(cython.int, self.own[g])
                if self.other[g] == last or (used >> own) & 1:
                    continue
                last = self.other[g]
                used |= (ONE << own) & ALL
                total += self.weight[g]
            best = total if total > best else best
        return best

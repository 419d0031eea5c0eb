"""Kernel: the codes of a print's minutiae, and how much those of two prints have in common.

Each minutia has a word for each of its neighbours, the cell of position and direction, in the
minutia's own frame, in which it lies in each of two grids; and twelve for the ridge orientation at
places neighbour_bits it. One print is put into tables: under each cell, a bit for each of its minutiae that
has a neighbour there. So a minutia of another print is compared with all of them at once: the bits
under its words are counted, all minutiae side by side. Minutiae that agree in enough are pairs; a
print counts by its pairs that lie on one another under one rotation and one shift. It is the same
number whichever of the two prints is in the tables. Interpreted, it runs as it stands; its oracle
in the tests is written in numpy.
"""

import cython
import numpy as np

COMPILED = cython.compiled

NEIGHBOUR_WORDS = cython.declare(cython.int, 12)  # words of neighbours
ORIENTATION_WORDS = cython.declare(cython.int, 12)  # words of orientations
SIDE = cython.declare(
    cython.int, 16
)  # cells orientation_bins a grid, in whose middle the minutia lies
SECTORS = cython.declare(cython.int, 8)  # of relative direction, in a direction_bin
# A word of a neighbour: its cell in the first grid, then a bit that is set where the cell counts
# for nothing, three that say how far on it lies in the second grid, and again one for nothing.
CELL = cython.declare(cython.int, 0x07FF)
FIRST = cython.declare(cython.int, 0x0FFF)  # both: no cell beyond 2048 has anything
NOT_FIRST = cython.declare(cython.int, 0x0800)
NOT_SECOND = cython.declare(cython.int, 0x8000)
NOWHERE = cython.declare(cython.int, 0x8800)
STEPS = cython.declare(cython.int, 12)  # bits to the right of those of the second grid
SECOND = cython.declare(cython.int, 4096)  # where it begins in the tables
NO_STEP = cython.declare(cython.int, 2304)  # from there to where there is nothing
CELLS = cython.declare(cython.int, 8448)  # of the tables
BINS = cython.declare(cython.int, 24)  # of relative orientation, in half a direction_bin
UNKNOWN = cython.declare(cython.int, 31)  # the word of no bin
PLACE = cython.declare(cython.int, 32)  # words that one place may have
ORIENTATIONS = cython.declare(cython.int, 255)  # codes of a cell's orientation, from 1 on
ROOM = cython.declare(cython.int, 64)  # minutiae that have words: bits of one
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)
# Times a single bit, its highest six bits say which: they are different for all 64.
WHICH = cython.declare(cython.ulonglong, 0x03F79D71B4CB0A89)
# A pair that agrees in n words of neighbours and f of orientations weighs 3 n + f - 8, 18 at most.
OF_NEIGHBOUR = cython.declare(cython.int, 3)
TOO_LITTLE = cython.declare(cython.int, 8)
MOST_WEIGHT = cython.declare(cython.int, 18)
TURN = cython.declare(cython.int, 16)  # steps of rotation that stand together: `most_turn` at least
TURNS_APART = cython.declare(cython.int, 16)  # so many in a direction_bin


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def second(word: cython.int) -> cython.int:
    """Return where in the tables the cell of the second grid stands that a word tells.

    Half a cell on in direction, the last sector runs into the first one of the next column; so it
    is with every print.
    """
    place: cython.int = SECOND + (word & CELL)
    place += (word >> STEPS & 1) + SECTORS * (word >> (STEPS + 1) & 1)
    return place + SECTORS * SIDE * (word >> (STEPS + 2) & 1)


def encode_neighbours(count, frame, share, coded, per_px, word):
    """Fill `word` for the minutiae of a print that are `coded`; the others have none.

    ``frame[i, :, k]`` begins with the position of neighbour k of minutia i in its frame, and
    ``share[i, k]`` is its direction there as a share of a direction_bin, 0 to 1. The cells are squares of
    ``1 / per_px`` pixels times sectors of direction, those of the second grid half a cell on in all
    three. Of the neighbours of a minutia in one cell, the first counts.
    """
    for i in range(count.shape[0]):
        for k in range(NEIGHBOUR_WORDS):
            word[i, k] = NOWHERE
        if not coded[i]:
            continue
        for k in range(count[i] if count[i] < NEIGHBOUR_WORDS else NEIGHBOUR_WORDS):
            u = cython.cast(cython.double, frame[i, 0, k]) * per_px + SIDE // 2
            v = cython.cast(cython.double, frame[i, 1, k]) * per_px + SIDE // 2
            if not (0.0 <= u < SIDE and 0.0 <= v < SIDE):
                continue
            t = share[i, k] * SECTORS
            column = cython.cast(cython.int, u)
            row = cython.cast(cython.int, v)
            sector = cython.cast(cython.int, t)
            sector = sector if sector < SECTORS else SECTORS - 1
            on_column = u - column >= 0.5
            on_row = v - row >= 0.5
            found = (row * SIDE + column) * SECTORS + sector
            found += ((4 * on_row + 2 * on_column) + (t - sector >= 0.5)) << STEPS
            if row + on_row == SIDE or column + on_column == SIDE:
                found |= NOT_SECOND
            for m in range(k):
                if not word[i, m] & NOT_FIRST and (word[i, m] ^ found) & CELL == 0:
                    found |= NOT_FIRST
                if not word[i, m] & NOT_SECOND and second(word[i, m]) == second(found):
                    found |= NOT_SECOND
            word[i, k] = cython.cast(cython.ushort, found)
    return 0


def encode_orientations(points, direction_bin, cell, first_row, first_column, step, places, word):
    """Fill `word` with the bin of the ridge orientation at `places`, in each minutia's own frame.

    `direction_bin` is a minutia's direction in 256ths of a direction_bin, `cell` the codes of the region's cells.
    """
    for i in range(points.shape[1]):
        c = points[2, i]
        s = points[3, i]
        for k in range(ORIENTATION_WORDS):
            word[i, k] = cython.cast(cython.uchar, UNKNOWN)
            x = (points[0, i] + c * places[0, k] - s * places[1, k]) / step - first_column
            y = -(points[1, i] + s * places[0, k] + c * places[1, k]) / step - first_row
            if not (0.0 <= x < cell.shape[1] and 0.0 <= y < cell.shape[0]):
                continue
            code = cell[cython.cast(cython.Py_ssize_t, y), cython.cast(cython.Py_ssize_t, x)]
            if code > 0:
                # in bins: a direction_bin is 256 steps of direction, half a direction_bin 255 of orientation
                relative = (code - 1.0) * BINS / ORIENTATIONS - direction_bin[i] * (
                    2.0 * BINS / 256.0
                )
                while relative < 0.0:
                    relative += BINS
                code = cython.cast(cython.int, relative)
                word[i, k] = cython.cast(cython.uchar, code if code < BINS else BINS - 1)
    return 0


@cython.final
@cython.cclass
class Prefilter:
    """One print in tables, and the room in which others are compared with it by their codes.

    At most `most_pairs` pairs of minutiae, 64 or fewer, are laid on one another; two may lie
    ``sqrt(near² + (spread * d)²)`` pixels off, d apart, and their rotations `most_turn` 256ths of a
    direction_bin, 16 or fewer.
    """

    def __init__(self, most_pairs, near, spread, most_turn) -> None:
        self.neighbour_bits = np.zeros(CELLS, np.uint64)
        # what is added to the cell of the first grid, by the highest four bits of a word
        steps = [second(k << STEPS) for k in range(8)]
        self.step = np.array(steps + [SECOND + NO_STEP] * 8, np.int32)
        self.orientation_bins = np.zeros(ORIENTATION_WORDS * PLACE, np.uint64)
        self.used = np.zeros(2 * ROOM * NEIGHBOUR_WORDS, np.int32)
        self.used_words = 0
        self.coded = 0
        self.has_flow = False
        self.own_row = np.zeros(ROOM, np.int32)
        self.own_turn = np.zeros(ROOM, np.int32)
        self.own_xy = np.zeros((ROOM, 2))
        angle = np.arange(256) * (2 * np.pi / 256)
        self.cosine_of = np.cos(angle)
        self.sine_of = np.sin(angle)
        which = np.zeros(64, np.uint8)
        for k in range(64):
            which[((int(WHICH) << k) & 0xFFFFFFFFFFFFFFFF) >> 58] = k
        self.which = which
        self.ones = self.twos = self.fours = self.eights = 0
        self.most = most_pairs
        self.near2 = near * near
        self.spread2 = spread * spread
        self.most_turn = most_turn
        # of pairs: the number of the own minutia among those with words, the other's row, weight
        self.pair = np.zeros((3, ROOM * ROOM), np.int32)
        self.turned = np.zeros((3, ROOM * ROOM), np.int32)
        self.start = np.zeros(ROOM + 1, np.int32)
        self.row = np.zeros((2, most_pairs), np.int32)
        self.angle = np.zeros(most_pairs, np.int32)
        self.a = np.zeros((2, most_pairs))
        self.b = np.zeros((2, most_pairs))
        self.first_of_row = np.zeros(most_pairs, np.int32)
        self.weighing = np.zeros(MOST_WEIGHT + 1, np.int32)
        self.turned_so = np.zeros(TURNS_APART, np.uint64)
        self.beside = np.zeros(most_pairs, np.uint64)
        self.explained_by = np.zeros(most_pairs, np.int32)

    def load(self, xy, direction_bin, neighbour_bits, orientation_bins, has_flow):
        """Put a print into the tables, in place of the one that is in them.

        Minutiae without a word of a neighbour, which are like no other, stay out, and those after
        the 64th that has one.
        """
        bit = ONE
        for k in range(self.used_words):
            self.neighbour_bits[self.used[k]] = 0
        for k in range(ORIENTATION_WORDS * PLACE):
            self.orientation_bins[k] = 0
        self.used_words = 0
        self.coded = 0
        self.has_flow = has_flow
        for i in range(xy.shape[0]):
            if self.coded == ROOM:
                break
            words = self.used_words
            for k in range(NEIGHBOUR_WORDS):
                word = cython.cast(cython.int, neighbour_bits[i, k])
                if not word & NOT_FIRST:
                    self.neighbour_bits[word & CELL] |= bit
                    self.used[self.used_words] = word & CELL
                    self.used_words += 1
                if not word & NOT_SECOND:
                    self.neighbour_bits[second(word)] |= bit
                    self.used[self.used_words] = second(word)
                    self.used_words += 1
            if self.used_words == words:
                continue
            for k in range(ORIENTATION_WORDS):
                if orientation_bins[i, k] != UNKNOWN:
                    for d in range(3):  # its own bin, and that on either side
                        b = (cython.cast(cython.int, orientation_bins[i, k]) + d + BINS - 1) % BINS
                        self.orientation_bins[PLACE * k + b] |= bit
            self.own_row[self.coded] = cython.cast(cython.int, i)
            self.own_turn[self.coded] = direction_bin[i]
            self.own_xy[self.coded, 0] = xy[i, 0]
            self.own_xy[self.coded, 1] = xy[i, 1]
            self.coded += 1
            bit = (bit << 1) & ALL
        return self.coded

    def score(
        self,
        first,
        last,
        xy,
        direction_bin,
        neighbour_bits,
        orientation_bins,
        has_flow,
        other_first,
    ):
        """Return how much speaks for another print, of the minutiae `first` to, not with, `last`.

        `other_first` says which of the two is print A, so that the same pairs come in the same
        order, whichever of them is in the tables.
        """
        pairs = self._pair(first, last, neighbour_bits, orientation_bins, has_flow)
        if other_first and pairs > 1:
            self._turn_over(pairs)
        pairs = self._best_of(pairs)
        self._place(pairs, first, xy, direction_bin, other_first)
        return self._explained(pairs)

    def score_many(
        self, first, start, xy, direction_bin, neighbour_bits, orientation_bins, has_flow, weight
    ):
        """Fill `weight` for as many prints, from the print `first` on, as if each came second."""
        for t in range(weight.shape[0]):
            weight[t] = self.score(
                start[first + t],
                start[first + t + 1],
                xy,
                direction_bin,
                neighbour_bits,
                orientation_bins,
                has_flow[first + t],
                False,
            )
        return 0

    def _pair(self, first, last, neighbour_bits, orientation_bins, has_flow):
        """Gather the pairs of minutiae that agree in enough; return their number.

        They come by the other print's minutia, then by the own. Where orientations are unknown, six
        are taken to agree.
        """
        found = 0
        f1 = 0
        f2 = ALL
        f4 = ALL
        f8 = 0
        flowing = has_flow and self.has_flow
        for j in range(first, last):
            self._count(
                self.neighbour_bits[neighbour_bits[j, 0] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 1] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 2] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 3] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 4] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 5] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 6] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 7] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 8] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 9] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 10] & FIRST],
                self.neighbour_bits[neighbour_bits[j, 11] & FIRST],
            )
            n1 = self.ones
            n2 = self.twos
            n4 = self.fours
            n8 = self.eights
            self._count(
                self.neighbour_bits[self._second(neighbour_bits[j, 0])],
                self.neighbour_bits[self._second(neighbour_bits[j, 1])],
                self.neighbour_bits[self._second(neighbour_bits[j, 2])],
                self.neighbour_bits[self._second(neighbour_bits[j, 3])],
                self.neighbour_bits[self._second(neighbour_bits[j, 4])],
                self.neighbour_bits[self._second(neighbour_bits[j, 5])],
                self.neighbour_bits[self._second(neighbour_bits[j, 6])],
                self.neighbour_bits[self._second(neighbour_bits[j, 7])],
                self.neighbour_bits[self._second(neighbour_bits[j, 8])],
                self.neighbour_bits[self._second(neighbour_bits[j, 9])],
                self.neighbour_bits[self._second(neighbour_bits[j, 10])],
                self.neighbour_bits[self._second(neighbour_bits[j, 11])],
            )
            # the sum of both, from the ones up
            carry = n1 & self.ones
            n1 ^= self.ones
            any_ = n2 ^ self.twos
            n16 = (n2 & self.twos) | (any_ & carry)
            n2 = any_ ^ carry
            any_ = n4 ^ self.fours
            carry = (n4 & self.fours) | (any_ & n16)
            n4 = any_ ^ n16
            any_ = n8 ^ self.eights
            n16 = (n8 & self.eights) | (any_ & carry)
            n8 = any_ ^ carry
            any_ = n1 | n2 | n4 | n8 | n16
            if not any_:
                continue
            if flowing:
                self._count(
                    self.orientation_bins[self._along(0, orientation_bins[j, 0])],
                    self.orientation_bins[self._along(1, orientation_bins[j, 1])],
                    self.orientation_bins[self._along(2, orientation_bins[j, 2])],
                    self.orientation_bins[self._along(3, orientation_bins[j, 3])],
                    self.orientation_bins[self._along(4, orientation_bins[j, 4])],
                    self.orientation_bins[self._along(5, orientation_bins[j, 5])],
                    self.orientation_bins[self._along(6, orientation_bins[j, 6])],
                    self.orientation_bins[self._along(7, orientation_bins[j, 7])],
                    self.orientation_bins[self._along(8, orientation_bins[j, 8])],
                    self.orientation_bins[self._along(9, orientation_bins[j, 9])],
                    self.orientation_bins[self._along(10, orientation_bins[j, 10])],
                    self.orientation_bins[self._along(11, orientation_bins[j, 11])],
                )
                f1 = self.ones
                f2 = self.twos
                f4 = self.fours
                f8 = self.eights
            # what weighs anything: three neighbours; two, and three orientations; one, and six
            any_ = n4 | n8 | n16 | (n2 & (n1 | f4 | f8 | (f1 & f2))) | (n1 & (f8 | (f4 & f2)))
            while any_:
                lowest = any_ & ((any_ ^ ALL) + 1)
                any_ ^= lowest
                place = cython.cast(cython.Py_ssize_t, self.which[((lowest * WHICH) & ALL) >> 58])
                weight = cython.cast(cython.int, (n1 >> place) & 1)
                weight += 2 * cython.cast(cython.int, (n2 >> place) & 1)
                weight += 4 * cython.cast(cython.int, (n4 >> place) & 1)
                weight += 8 * cython.cast(cython.int, (n8 >> place) & 1)
                weight += 16 * cython.cast(cython.int, (n16 >> place) & 1)
                weight = OF_NEIGHBOUR * weight - TOO_LITTLE
                weight += cython.cast(cython.int, (f1 >> place) & 1)
                weight += 2 * cython.cast(cython.int, (f2 >> place) & 1)
                weight += 4 * cython.cast(cython.int, (f4 >> place) & 1)
                weight += 8 * cython.cast(cython.int, (f8 >> place) & 1)
                self.pair[0, found] = cython.cast(cython.int, place)
                self.pair[1, found] = cython.cast(cython.int, j - first)
                self.pair[2, found] = weight if weight < MOST_WEIGHT else MOST_WEIGHT
                found += 1
        return found

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def _second(self, word: cython.ushort) -> cython.Py_ssize_t:
        """Return what `second` does, or where there is nothing, of any word."""
        return self.step[word >> STEPS] + (word & CELL)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def _along(self, k: cython.Py_ssize_t, word: cython.uchar) -> cython.Py_ssize_t:
        """Return where in its table the k-th word of an orientation stands."""
        return PLACE * k + cython.cast(cython.Py_ssize_t, word)

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
        self.ones = cython.cast(cython.ulonglong, odd_1 ^ odd_2)
        two_6 = odd_1 & odd_2
        odd = two_1 ^ two_2
        odd_1 = odd ^ two_3
        four_1 = (two_1 & two_2) | (odd & two_3)
        odd = two_4 ^ two_5
        odd_2 = odd ^ two_6
        four_2 = (two_4 & two_5) | (odd & two_6)
        self.twos = cython.cast(cython.ulonglong, odd_1 ^ odd_2)
        four_3 = odd_1 & odd_2
        odd = four_1 ^ four_2
        self.fours = cython.cast(cython.ulonglong, odd ^ four_3)
        self.eights = cython.cast(cython.ulonglong, (four_1 & four_2) | (odd & four_3))
        return 0

    def _turn_over(self, pairs):
        """Put the pairs in the order of the own minutiae, then of the others."""
        behind = 0
        for k in range(self.coded + 1):
            self.start[k] = 0
        for k in range(pairs):
            self.start[self.pair[0, k]] += 1
        for k in range(self.coded):
            place = self.start[k]
            self.start[k] = behind
            behind += place
        for k in range(pairs):
            place = self.start[self.pair[0, k]]
            self.start[self.pair[0, k]] += 1
            self.turned[0, place] = self.pair[0, k]
            self.turned[1, place] = self.pair[1, k]
            self.turned[2, place] = self.pair[2, k]
        for k in range(pairs):
            self.pair[0, k] = self.turned[0, k]
            self.pair[1, k] = self.turned[1, k]
            self.pair[2, k] = self.turned[2, k]
        return 0

    def _best_of(self, pairs):
        """Keep as many pairs as there may be, those that score most, the first of equals."""
        least = MOST_WEIGHT
        above = 0
        kept = 0
        if pairs <= self.most:
            return pairs
        for k in range(MOST_WEIGHT + 1):
            self.weighing[k] = 0
        for k in range(pairs):
            self.weighing[self.pair[2, k]] += 1
        while above + self.weighing[least] < self.most:
            above += self.weighing[least]
            least -= 1
        equal = self.most - above
        for k in range(pairs):
            if self.pair[2, k] < least or (self.pair[2, k] == least and equal == 0):
                continue
            equal -= self.pair[2, k] == least
            self.pair[0, kept] = self.pair[0, k]
            self.pair[1, kept] = self.pair[1, k]
            self.pair[2, kept] = self.pair[2, k]
            kept += 1
        return kept

    def _place(self, pairs, first, xy, direction_bin, other_first):
        """Note rows and places of the pairs in prints A and B, and how B is turned to lie on A."""
        of_own = 1 if other_first else 0
        for h in range(pairs):
            own = self.pair[0, h]
            other = first + self.pair[1, h]
            self.row[of_own, h] = self.own_row[own]
            self.row[1 - of_own, h] = self.pair[1, h]
            g = 0
            while self.row[0, g] != self.row[0, h]:
                g += 1
            self.first_of_row[h] = cython.cast(cython.int, g)
            apart = self.own_turn[own] - cython.cast(cython.int, direction_bin[other])
            if other_first:
                self.angle[h] = -apart & 255
                self.a[0, h] = xy[other, 0]
                self.a[1, h] = xy[other, 1]
                self.b[0, h] = self.own_xy[own, 0]
                self.b[1, h] = self.own_xy[own, 1]
            else:
                self.angle[h] = apart & 255
                self.a[0, h] = self.own_xy[own, 0]
                self.a[1, h] = self.own_xy[own, 1]
                self.b[0, h] = xy[other, 0]
                self.b[1, h] = xy[other, 1]
        return 0

    def _explained(self, pairs):
        """Return the greatest weight of pairs that lie with one of them under one transform.

        Of the pairs of one minutia, of either print, the first counts. Only those are tried whose
        rotation is about the same.
        """
        best = 0
        for h in range(TURNS_APART):
            self.turned_so[h] = 0
        for h in range(pairs):
            self.explained_by[h] = -1
            self.beside[h] = (ONE << h) & ALL
        for h in range(pairs - 1, -1, -1):
            direction_bin = self.angle[h] // TURN
            left = cython.cast(cython.ulonglong, self.turned_so[direction_bin])
            left |= cython.cast(cython.ulonglong, self.turned_so[(direction_bin + 1) % TURNS_APART])
            left |= cython.cast(
                cython.ulonglong, self.turned_so[(direction_bin + TURNS_APART - 1) % TURNS_APART]
            )
            self.turned_so[direction_bin] |= (ONE << h) & ALL
            c = self.cosine_of[self.angle[h]]
            s = self.sine_of[self.angle[h]]
            while left:
                lowest = left & ((left ^ ALL) + 1)
                left ^= lowest
                g = cython.cast(cython.Py_ssize_t, self.which[((lowest * WHICH) & ALL) >> 58])
                apart = (self.angle[g] - self.angle[h] + 128) & 255
                if apart < 128 - self.most_turn or apart > 128 + self.most_turn:
                    continue
                dx = self.b[0, g] - self.b[0, h]
                dy = self.b[1, g] - self.b[1, h]
                ex = c * dx - s * dy - (self.a[0, g] - self.a[0, h])
                ey = s * dx + c * dy - (self.a[1, g] - self.a[1, h])
                if ex * ex + ey * ey <= self.near2 + self.spread2 * (dx * dx + dy * dy):
                    self.beside[h] |= lowest
                    self.beside[g] |= (ONE << h) & ALL
        for h in range(pairs):
            total = 0
            last = -1
            left = cython.cast(cython.ulonglong, self.beside[h])
            while left:
                lowest = left & ((left ^ ALL) + 1)
                left ^= lowest
                g = cython.cast(cython.Py_ssize_t, self.which[((lowest * WHICH) & ALL) >> 58])
                if self.row[1, g] == last or self.explained_by[self.first_of_row[g]] == h:
                    continue
                last = self.row[1, g]
                self.explained_by[self.first_of_row[g]] = cython.cast(cython.int, h)
                total += self.pair[2, g]
            best = total if total > best else best
        return best

"""Kernel: score prints against one print by their bit descriptors (see `_encode_kernel`).

One print is put into tables: under each cell, a bit for each of its minutiae that has a neighbour
there. So a minutia of another print is compared with all of them at once: the bits under its words
are counted for all minutiae in parallel. Minutiae that agree in enough words are pairs; the score
is the weight of the pairs that agree in rotation and shift (see `_consistency_kernel`). It is the
same whichever of the two prints is in the tables.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._consistency_kernel import PairSet
    from cython.cimports.fpmatch.matching._encode_kernel import second
else:
    from fpmatch.matching._consistency_kernel import PairSet
    from fpmatch.matching._encode_kernel import second

NEIGHBOUR_WORDS = cython.declare(cython.int, 12)
ORIENTATION_WORDS = cython.declare(cython.int, 12)
# A word of a neighbour: its cell in the first grid; a bit that is set where this cell does not
# count; three bits for the step from there to the cell of the second grid; a bit that is set where
# that cell does not count.
CELL = cython.declare(cython.int, 0x07FF)
NOT_FIRST = cython.declare(cython.int, 0x0800)
NOT_SECOND = cython.declare(cython.int, 0x8000)
STEPS = cython.declare(cython.int, 12)  # bits to the right of the step
SECOND = cython.declare(cython.int, 4096)  # where the second grid begins in the tables
BINS = cython.declare(cython.int, 24)  # of relative orientation, in half a turn
UNKNOWN = cython.declare(cython.int, 31)  # the word of no bin
FIRST = cython.declare(cython.int, 0x0FFF)  # cell and first bit: no cell beyond 2048 is used
NO_STEP = cython.declare(cython.int, 2304)  # from the second grid to where there is nothing
CELLS = cython.declare(cython.int, 8448)  # of the tables
ROOM = cython.declare(cython.int, 64)  # minutiae in the tables: bits of a word
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)
# The product with a single bit has highest six bits that are different for all 64.
WHICH = cython.declare(cython.ulonglong, 0x03F79D71B4CB0A89)
# A pair that agrees in n words of neighbours and f of orientations weighs 3 n + f - 8, 18 at most.
OF_NEIGHBOUR = cython.declare(cython.int, 3)
TOO_LITTLE = cython.declare(cython.int, 8)


@cython.final
@cython.cclass
class Prefilter:
    """Score prints against one print, which is in the tables; the parameters are of `PairSet`."""

    def __init__(self, most_pairs, near, spread, most_turn) -> None:
        self.neighbour_table = memoryview(np.zeros(CELLS, np.uint64))
        # what is added to the cell of the first grid, by the highest four bits of a word
        steps = [second(k << STEPS) for k in range(8)]
        self.step = memoryview(np.array(steps + [SECOND + NO_STEP] * 8, np.int32))
        self.orientation_table = memoryview(np.zeros((ORIENTATION_WORDS, UNKNOWN + 1), np.uint64))
        self.used = memoryview(np.zeros(2 * ROOM * NEIGHBOUR_WORDS, np.int32))
        self.used_words = self.coded = 0
        self.has_flow = False
        self.own_row, self.own_turn = map(memoryview, np.zeros((2, ROOM), np.int32))
        self.own_xy = memoryview(np.zeros((ROOM, 2)))
        self.ones = self.twos = self.fours = self.eights = 0
        self.pairs = PairSet(ROOM, most_pairs, near, spread, most_turn)
        self.which = self.pairs.which

    def load(self, xy, direction_bin, neighbour_bits, orientation_bins, has_flow):
        """Put a print into the tables, in place of the one that is in them.

        Minutiae without a word of a neighbour are left out, and those after the 64th that has one.
        """
        bit = ONE
        for k in range(self.used_words):
            self.neighbour_table[self.used[k]] = 0
        for k in range(ORIENTATION_WORDS):
            for b in range(BINS):
                self.orientation_table[k, b] = 0
        self.used_words = self.coded = 0
        self.has_flow = has_flow
        for i in range(xy.shape[0]):
            if self.coded == ROOM:
                break
            words = self.used_words
            for k in range(NEIGHBOUR_WORDS):
                word = neighbour_bits[i, k]
                if not word & NOT_FIRST:
                    self.neighbour_table[word & CELL] |= bit
                    self.used[self.used_words] = word & CELL
                    self.used_words += 1
                if not word & NOT_SECOND:
                    self.neighbour_table[second(word)] |= bit
                    self.used[self.used_words] = second(word)
                    self.used_words += 1
            if self.used_words == words:
                continue
            for k in range(ORIENTATION_WORDS):
                if orientation_bins[i, k] != UNKNOWN:
                    for d in range(3):  # its own bin, and that on either side
                        b = (orientation_bins[i, k] + d + BINS - 1) % BINS
                        self.orientation_table[k, b] |= bit
            self.own_row[self.coded] = i
            self.own_turn[self.coded] = direction_bin[i]
            self.own_xy[self.coded, 0] = xy[i, 0]
            self.own_xy[self.coded, 1] = xy[i, 1]
            self.coded += 1
            bit = (bit << 1) & ALL
        return self.coded

    def score(
        self, first, last, xy, direction_bin, neighbour_bits, orientation_bins, flowing, other_first
    ):
        """Return the score of another print, of the minutiae from `first` up to `last`.

        `other_first` states which of the two is print A, so that the same pairs come in the same
        order, whichever of them is in the tables.
        """
        self._pair(first, last, neighbour_bits, orientation_bins, flowing and self.has_flow)
        if other_first and self.pairs.count > 1:
            self.pairs.order_by_own(self.coded)
        self.pairs.keep_best()
        self.pairs.locate(
            self.own_row, self.own_turn, self.own_xy, first, xy, direction_bin, other_first
        )
        return self.pairs.consistent_weight()

    def score_many(
        self, first, start, xy, direction_bin, neighbour_bits, orientation_bins, has_flow, weight
    ):
        """Fill `weight` for as many prints, from the print `first` on, as if each came second."""
        with cython.nogil:
            for t in range(weight.shape[0]):
                begin, end, flowing = start[first + t], start[first + t + 1], has_flow[first + t]
                weight[t] = self.score(
                    begin, end, xy, direction_bin, neighbour_bits, orientation_bins, flowing, False
                )
        return 0

    def _pair(self, first, last, neighbour_bits, orientation_bins, flowing):
        """Gather the pairs of minutiae that agree in enough words; return their number.

        They are in the order of the other print's minutiae, then of the own. Where orientations
        are unknown, six are taken to agree.
        """
        self.pairs.count = 0
        f1 = f8 = 0
        f2 = f4 = ALL
        for j in range(first, last):
            self._count(
                self.neighbour_table[neighbour_bits[j, 0] & FIRST],
                self.neighbour_table[neighbour_bits[j, 1] & FIRST],
                self.neighbour_table[neighbour_bits[j, 2] & FIRST],
                self.neighbour_table[neighbour_bits[j, 3] & FIRST],
                self.neighbour_table[neighbour_bits[j, 4] & FIRST],
                self.neighbour_table[neighbour_bits[j, 5] & FIRST],
                self.neighbour_table[neighbour_bits[j, 6] & FIRST],
                self.neighbour_table[neighbour_bits[j, 7] & FIRST],
                self.neighbour_table[neighbour_bits[j, 8] & FIRST],
                self.neighbour_table[neighbour_bits[j, 9] & FIRST],
                self.neighbour_table[neighbour_bits[j, 10] & FIRST],
                self.neighbour_table[neighbour_bits[j, 11] & FIRST],
            )
            n1, n2, n4, n8 = self.ones, self.twos, self.fours, self.eights
            self._count(
                self.neighbour_table[self._second(neighbour_bits[j, 0])],
                self.neighbour_table[self._second(neighbour_bits[j, 1])],
                self.neighbour_table[self._second(neighbour_bits[j, 2])],
                self.neighbour_table[self._second(neighbour_bits[j, 3])],
                self.neighbour_table[self._second(neighbour_bits[j, 4])],
                self.neighbour_table[self._second(neighbour_bits[j, 5])],
                self.neighbour_table[self._second(neighbour_bits[j, 6])],
                self.neighbour_table[self._second(neighbour_bits[j, 7])],
                self.neighbour_table[self._second(neighbour_bits[j, 8])],
                self.neighbour_table[self._second(neighbour_bits[j, 9])],
                self.neighbour_table[self._second(neighbour_bits[j, 10])],
                self.neighbour_table[self._second(neighbour_bits[j, 11])],
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
                    self.orientation_table[0, orientation_bins[j, 0]],
                    self.orientation_table[1, orientation_bins[j, 1]],
                    self.orientation_table[2, orientation_bins[j, 2]],
                    self.orientation_table[3, orientation_bins[j, 3]],
                    self.orientation_table[4, orientation_bins[j, 4]],
                    self.orientation_table[5, orientation_bins[j, 5]],
                    self.orientation_table[6, orientation_bins[j, 6]],
                    self.orientation_table[7, orientation_bins[j, 7]],
                    self.orientation_table[8, orientation_bins[j, 8]],
                    self.orientation_table[9, orientation_bins[j, 9]],
                    self.orientation_table[10, orientation_bins[j, 10]],
                    self.orientation_table[11, orientation_bins[j, 11]],
                )
                f1, f2, f4, f8 = self.ones, self.twos, self.fours, self.eights
            # what weighs anything: three neighbours; two, and three orientations; one, and six
            any_ = n4 | n8 | n16 | (n2 & (n1 | f4 | f8 | (f1 & f2))) | (n1 & (f8 | (f4 & f2)))
            while any_:
                lowest = any_ & ((any_ ^ ALL) + 1)
                any_ ^= lowest
                place = self.which[((lowest * WHICH) & ALL) >> 58]
                weight = (n1 >> place) & 1
                weight += 2 * ((n2 >> place) & 1)
                weight += 4 * ((n4 >> place) & 1)
                weight += 8 * ((n8 >> place) & 1)
                weight += 16 * ((n16 >> place) & 1)
                weight = OF_NEIGHBOUR * weight - TOO_LITTLE
                weight += (f1 >> place) & 1
                weight += 2 * ((f2 >> place) & 1)
                weight += 4 * ((f4 >> place) & 1)
                weight += 8 * ((f8 >> place) & 1)
                self.pairs.add(place, j - first, weight)
        return self.pairs.count

    def _second(self, word):
        """Return what `second` does, of any word: an empty cell where it does not count."""
        return self.step[word >> STEPS] + (word & CELL)

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


if not cython.compiled:
    from fpmatch.matching.numpy_forms import descriptors

    Prefilter._pair = descriptors.pair

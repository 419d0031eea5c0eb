# mypy: ignore-errors
"""Kernel: score prints against one print by their bit descriptors (see `_encode_kernel`).

One print is put into tables: under each cell, a bit for each of its minutiae that has a neighbour
there. So a minutia of another print is compared with all of them at once: the bits under its words
are counted for all minutiae in parallel. Minutiae that agree in enough words are pairs; the score
is the weight of the pairs that agree in rotation and shift (see `_consistency_kernel`). It is the
same whichever of the two prints is in the tables.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.prints._kernels._bits import (
    BEYOND,
    CELL,
    FIRST,
    LAST,
    MOST_WEIGHT,
    ROOM,
    TOO_LITTLE,
    WORDS,
    lowest_place,
    second,
)
from cython.cimports.fpmatch.matching.prints._kernels._consistency_kernel import PairSet

from fpmatch.matching.constants import prints

NOT_FIRST = cython.declare(cython.int, prints.NOT_FIRST)
NOT_SECOND = cython.declare(cython.int, prints.NOT_SECOND)
BINS = cython.declare(cython.int, prints.ORIENTATION_BINS)
UNKNOWN = cython.declare(cython.int, prints.UNKNOWN_BIN)
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)


@cython.final
@cython.cclass
class Prefilter:
    """Score prints against one print, which is in the tables; for one thread."""

    def __init__(self, parameters) -> None:
        self.neighbour_table = np.zeros(LAST + 1, np.uint64)
        self.orientation_table = np.zeros((WORDS, UNKNOWN + 1), np.uint64)
        self.used = np.zeros(2 * ROOM * WORDS, np.int32)
        self.used_words = self.coded = 0
        self.has_flow = False
        self.own_turn = np.zeros(ROOM, np.int32)
        self.own_xy = np.zeros((ROOM, 2))
        self.cell = np.zeros((2, ROOM, WORDS), np.uint16)
        self.pairs = PairSet(ROOM, parameters)

    @cython.locals(k=cython.Py_ssize_t, b=cython.int, d=cython.int)
    def load(self, xy, direction_bin, neighbour_bits, orientation_bins, has_flow):
        """Put a print into the tables, in place of the one that is in them.

        Minutiae without a word of a neighbour are left out, and those after the 64th that has one.
        """
        bit = ONE
        for k in range(self.used_words):
            self.neighbour_table[self.used[k]] = 0
        for k in range(WORDS):
            for b in range(BINS):
                self.orientation_table[k, b] = 0
        self.used_words = self.coded = 0
        self.has_flow = has_flow
        for i in range(xy.shape[0]):
            if self.coded == ROOM:
                break
            words = self.used_words
            for k in range(WORDS):
                word: cython.int = neighbour_bits[i, k]
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
            for k in range(WORDS):
                if orientation_bins[i, k] != UNKNOWN:
                    for d in range(3):  # its own bin, and that on either side
                        b = (orientation_bins[i, k] + d + BINS - 1) % BINS
                        self.orientation_table[k, b] |= bit
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
        flowing = flowing and self.has_flow
        self._pair(first, last, neighbour_bits, orientation_bins, flowing, other_first)
        if other_first and self.pairs.count > 1:
            self.pairs.order_by_own(self.coded)
        self.pairs.keep_best()
        self.pairs.locate(self.own_turn, self.own_xy, first, xy, direction_bin, other_first)
        return self.pairs.consistent_weight()

    @cython.locals(k=cython.Py_ssize_t, flowing=cython.bint, bits=cython.ulonglong)
    @cython.locals(n1=cython.ulonglong, n2=cython.ulonglong, n4=cython.ulonglong)
    @cython.locals(n8=cython.ulonglong, n16=cython.ulonglong, f1=cython.ulonglong)
    @cython.locals(f2=cython.ulonglong, f4=cython.ulonglong, f8=cython.ulonglong)
    @cython.locals(s1=cython.ulonglong, s2=cython.ulonglong, s4=cython.ulonglong)
    @cython.locals(s8=cython.ulonglong, s16=cython.ulonglong, s32=cython.ulonglong)
    @cython.locals(v=cython.ulonglong, w=cython.ulonglong, two=cython.ulonglong)
    @cython.locals(four=cython.ulonglong, eight=cython.ulonglong, more=cython.ulonglong)
    def _pair(self, first, last, neighbour_bits, orientation_bins, flowing, other_first):
        """Gather the pairs of minutiae that agree in enough words; return their number.

        They are in the order of the other print's minutiae, then of the own. Where orientations
        are unknown, six are taken to agree. Left out are pairs that weigh too little to be kept
        beside those before them.
        """
        table = cython.address(self.neighbour_table[0])
        own_of = cython.address(self.pairs.pair[0, 0])
        other_of = cython.address(self.pairs.pair[1, 0])
        weight_of = cython.address(self.pairs.pair[2, 0])
        of_weight = cython.address(self.pairs.of_weight[0])
        for k in range(MOST_WEIGHT + 1):
            of_weight[k] = 0
        most = self.pairs.most
        room: cython.int = self.pairs.pair.shape[1]
        gathered = above = least = limit = t = 0
        for j in range(first, last):
            at: cython.Py_ssize_t = (j - first) % ROOM
            if at == 0:
                self._find_cells(j, min(last - j, ROOM), neighbour_bits)
            # bit b of n1, n2, n4, n8, n16: of the number of words that the own minutia b has too
            n1 = n2 = n4 = n8 = n16 = 0
            for grid in range(2):
                cells = cython.address(self.cell[grid, at, 0])
                for k in range(0, WORDS, 2):
                    v, w = table[cells[k]], table[cells[k + 1]]
                    two = twice(n1, v, w)
                    n1 ^= v ^ w
                    four = n2 & two
                    n2 ^= two
                    eight = n4 & four
                    n4 ^= four
                    n16 |= n8 & eight
                    n8 ^= eight
            f1 = f8 = 0
            f2 = f4 = ALL
            if flowing:
                f2 = f4 = 0
                bins = cython.address(orientation_bins[j, 0])
                for k in range(0, WORDS, 2):
                    v = self.orientation_table[k, bins[k]]
                    w = self.orientation_table[k + 1, bins[k + 1]]
                    two = twice(f1, v, w)
                    f1 ^= v ^ w
                    four = f2 & two
                    f2 ^= two
                    f8 |= f4 & four
                    f4 ^= four
            # three times the neighbours and the orientations, from the ones up
            s1 = n1 ^ f1
            two = n1 & f1
            v = n1 ^ n2 ^ f2
            four = twice(n1, n2, f2)
            s2 = v ^ two
            two &= v
            v = n2 ^ n4 ^ f4
            eight = twice(n2, n4, f4)
            s4 = v ^ four ^ two
            more = twice(v, four, two)
            v = n4 ^ n8 ^ f8
            w = twice(n4, n8, f8)
            s8 = v ^ eight ^ more
            more = twice(v, eight, more)
            v = n8 ^ n16 ^ w
            s16 = v ^ more
            s32 = n16 | (n8 & w) | (v & more)
            # where the sum is greater than what is too little: the carry of their difference
            t = TOO_LITTLE + 1 + limit
            more = twice(s4, none_of(t, 4), twice(s2, none_of(t, 2), s1 | none_of(t, 1)))
            more = twice(s16, none_of(t, 16), twice(s8, none_of(t, 8), more))
            bits = (n1 | n2 | n4 | n8 | n16) & (s32 | more)
            while bits:
                place = lowest_place(bits)
                bits &= bits - 1
                weight: cython.int = (s1 >> place) & 1
                weight += 2 * ((s2 >> place) & 1)
                weight += 4 * ((s4 >> place) & 1)
                weight += 8 * ((s8 >> place) & 1)
                weight += 16 * ((s16 >> place) & 1)
                weight += 32 * ((s32 >> place) & 1)
                weight = min(weight - TOO_LITTLE, MOST_WEIGHT)
                if weight <= limit or gathered == room:
                    continue
                own_of[gathered] = place
                other_of[gathered] = j - first
                weight_of[gathered] = weight
                gathered += 1
                if weight <= least:
                    continue
                of_weight[weight] += 1
                above += 1
                while above >= most:
                    least += 1
                    above -= of_weight[least]
                    limit = least - 1 if other_first else least
        self.pairs.count = gathered
        self.pairs.least = least
        self.pairs.equal = most - above
        return gathered

    def _find_cells(self, first, count, neighbour_bits):
        """Write the cells of the words of so many minutiae; an empty one where none counts."""
        words = cython.address(neighbour_bits[first, 0])
        one = cython.address(self.cell[0, 0, 0])
        other = cython.address(self.cell[1, 0, 0])
        for k in range(count * WORDS):
            one[k] = words[k] & FIRST  # beyond the first grid where it does not count
            # beyond all cells, if the highest bit is set
            cell: cython.int = second(words[k]) + (words[k] >> 2 & BEYOND)
            other[k] = min(cell, LAST)
        return 0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def twice(a: cython.ulonglong, b: cython.ulonglong, c: cython.ulonglong) -> cython.ulonglong:
    """Return the bits that at least two of three have."""
    return (a & b) | ((a ^ b) & c)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def none_of(value: cython.int, bit: cython.int) -> cython.ulonglong:
    """Return all bits if a bit of a value is not set, none if it is."""
    return 0 if value & bit else ALL

# mypy: ignore-errors
"""Kernel: score prints against one print by their bit descriptors (words: `prints.prepared`).

One print is put into tables: under each cell, a bit for each of its minutiae that has a neighbour
there. So a minutia of another print is compared with all of them at once: the bits under its words
are counted for all minutiae in parallel. Minutiae that agree in enough words are pairs; the score
is the weight of the pairs that agree in one rotation and one shift. It is the same whichever of the
two prints is in the tables.
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
from cython.cimports.libc.string import memset

from fpmatch.matching import constants

NOT_FIRST = cython.declare(cython.int, constants.NOT_FIRST)
NOT_SECOND = cython.declare(cython.int, constants.NOT_SECOND)
BINS = cython.declare(cython.int, constants.ORIENTATION_BINS)
UNKNOWN = cython.declare(cython.int, constants.UNKNOWN_BIN)
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)
TURN = cython.declare(cython.int, 16)  # 256ths of a turn in one group: `most_turn` at least
TURNS_APART = cython.declare(cython.int, 16)  # groups in a turn


@cython.final
@cython.cclass
class Prefilter:
    """Score prints against one print, which is in the tables; for one thread.

    ``pair[:, k]`` are the number of the own minutia, that of the other's, and the weight; `count`
    pairs are set. At most `most_pairs`, 64 or fewer, are compared with each other: two agree where
    they lie at most ``sqrt(near_px² + (near_per_px * d)²)`` pixels off, d apart, and their
    rotations differ by at most `pair_turn_deg`, which is 22.5 or less.
    """

    def __init__(self, parameters) -> None:
        self.neighbour_table = np.zeros(LAST + 1, np.uint64)
        self.orientation_table = np.zeros((WORDS, UNKNOWN + 1), np.uint64)
        self.own_turn = np.zeros(ROOM, np.int32)
        self.own_xy = np.zeros((ROOM, 2))
        self.cell = np.zeros((2, ROOM, WORDS), np.uint16)
        p, most = parameters, parameters.most_pairs
        self.most = most
        self.near2, self.spread2 = p.near_px * p.near_px, p.near_per_px * p.near_per_px
        self.most_turn = round(p.pair_turn_deg * constants.TURNS / 360)
        angle = np.arange(256) * (2 * np.pi / 256)
        self.cosine_of, self.sine_of = np.cos(angle), np.sin(angle)
        self.pair = np.zeros((3, ROOM * ROOM), np.int32)
        self.row = np.zeros((2, most), np.int32)
        self.a, self.b = np.zeros((2, 2, most))
        self.angle, self.bound = np.zeros((2, most), np.int32)
        self.of_weight = np.zeros(MOST_WEIGHT + 1, np.int32)
        self.of_turn = np.zeros(TURNS_APART, np.uint64)
        self.consistent = np.zeros(most, np.uint64)

    @cython.locals(k=cython.Py_ssize_t, b=cython.int, d=cython.int)
    def load(self, xy, direction_bin, neighbour_bits, orientation_bins, has_flow):
        """Put a print into the tables, in place of the one that is in them.

        Minutiae without a word of a neighbour are left out, and those after the 64th that has one.
        """
        bit = ONE
        memset(cython.address(self.neighbour_table[0]), 0, 8 * self.neighbour_table.shape[0])
        memset(cython.address(self.orientation_table[0, 0]), 0, 8 * WORDS * (UNKNOWN + 1))
        self.coded, self.has_flow = 0, has_flow
        for i in range(xy.shape[0]):
            if self.coded == ROOM:
                break
            some: cython.bint = False
            for k in range(WORDS):
                word: cython.int = neighbour_bits[i, k]
                if not word & NOT_FIRST:
                    self.neighbour_table[word & CELL] |= bit
                    some = True
                if not word & NOT_SECOND:
                    self.neighbour_table[second(word)] |= bit
                    some = True
            if not some:
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
        self._keep_best(other_first)
        self._locate(first, xy, direction_bin, other_first)
        return self._consistent_weight()

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
        own_of = cython.address(self.pair[0, 0])
        other_of = cython.address(self.pair[1, 0])
        weight_of = cython.address(self.pair[2, 0])
        of_weight = cython.address(self.of_weight[0])
        for k in range(MOST_WEIGHT + 1):
            of_weight[k] = 0
        most = self.most
        room: cython.int = self.pair.shape[1]
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
        self.count = gathered
        self.least = least
        self.equal = most - above
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

    @cython.locals(k=cython.int, entry=cython.int)
    def _keep_best(self, other_first):
        """Keep pairs that weigh more than `least`, and the first `equal` that weigh as much.

        They come in the order of B's minutiae, then of A's; return their number.
        """
        chosen: cython.int = 0
        equal: cython.int = self.equal
        for k in range(self.count):
            own, other, weight = self.pair[0, k], self.pair[1, k], self.pair[2, k]
            if weight < self.least:
                continue
            at: cython.Py_ssize_t = chosen
            while other_first and at > 0 and self.pair[0, at - 1] > own:
                for entry in range(3):
                    self.pair[entry, at] = self.pair[entry, at - 1]
                at -= 1
            self.pair[0, at], self.pair[1, at], self.pair[2, at] = own, other, weight
            chosen += 1
        self.count = 0
        for k in range(chosen):
            ties: cython.bint = self.pair[2, k] == self.least
            if ties and equal == 0:
                continue
            equal -= ties
            for entry in range(3):
                self.pair[entry, self.count] = self.pair[entry, k]
            self.count += 1
        return self.count

    @cython.locals(h=cython.Py_ssize_t)
    def _locate(self, first, xy, direction_bin, other_first):
        """Write rows and positions of the pairs in prints A and B, and the rotation of B onto A."""
        of_own = 1 if other_first else 0
        for h in range(self.count):
            own: cython.Py_ssize_t = self.pair[0, h]
            other = first + self.pair[1, h]
            # a number below 64: there are no more own minutiae, nor pairs
            self.row[0, h] = own
            if other_first:
                g = 0
                while self.pair[1, g] != self.pair[1, h]:
                    g += 1
                self.row[0, h] = g
            self.row[1, h] = self.pair[1 - of_own, h]
            apart = self.own_turn[own] - cython.cast(cython.int, direction_bin[other])
            self.angle[h] = (-apart if other_first else apart) & 255
            for k in range(2):
                self.a[k, h] = xy[other, k] if other_first else self.own_xy[own, k]
                self.b[k, h] = self.own_xy[own, k] if other_first else xy[other, k]
        return 0

    @cython.locals(best=cython.int)
    def _consistent_weight(self):
        """Return the greatest weight of pairs that agree with one of them in rotation and shift.

        Only pairs of about the same rotation are compared.
        """
        best = 0
        for h in range(TURNS_APART):
            self.of_turn[h] = 0
        for h in range(self.count):
            self.consistent[h] = (ONE << h) & ALL
            self.bound[h] = self.pair[2, h]
        for h in range(self.count - 1, -1, -1):
            turn: cython.Py_ssize_t = self.angle[h] // TURN
            left = self.of_turn[turn]
            left |= self.of_turn[(turn + 1) % TURNS_APART]
            left |= self.of_turn[(turn + TURNS_APART - 1) % TURNS_APART]
            self.of_turn[turn] |= (ONE << h) & ALL
            c = self.cosine_of[self.angle[h]]
            s = self.sine_of[self.angle[h]]
            while left:
                g: cython.Py_ssize_t = lowest_place(left)
                left &= left - 1
                apart: cython.int = (self.angle[g] - self.angle[h] + self.most_turn) & 255
                dx = self.b[0, g] - self.b[0, h]
                dy = self.b[1, g] - self.b[1, h]
                ex = c * dx - s * dy - (self.a[0, g] - self.a[0, h])
                ey = s * dx + c * dy - (self.a[1, g] - self.a[1, h])
                near: cython.bint = ex * ex + ey * ey <= self.near2 + self.spread2 * (
                    dx * dx + dy * dy
                )
                if near & (apart <= 2 * self.most_turn):
                    self.consistent[h] |= (ONE << g) & ALL
                    self.consistent[g] |= (ONE << h) & ALL
                    self.bound[h] += self.pair[2, g]
                    self.bound[g] += self.pair[2, h]
        for h in range(self.count):
            if self.bound[h] > best:
                best = max(best, self._weight_with(h))
        return best

    def _weight_with(self, h):
        """Return the weight of the pairs that agree with pair h.

        Of the pairs of one minutia, of either print, the first counts.
        """
        total: cython.int = 0
        counted = 0
        last: cython.int = -1
        left = self.consistent[h]
        while left:
            g: cython.Py_ssize_t = lowest_place(left)
            left &= left - 1
            if self.row[1, g] == last or counted >> self.row[0, g] & 1:
                continue
            last = self.row[1, g]
            counted |= (ONE << self.row[0, g]) & ALL
            total += self.pair[2, g]
        return total


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

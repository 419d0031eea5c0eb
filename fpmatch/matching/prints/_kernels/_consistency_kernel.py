# mypy: ignore-errors
"""Kernel: the pairs of minutiae of two prints that agree in one rotation and one shift."""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.prints._kernels._bits import lowest_place
from cython.cimports.libc.math import sqrt

from fpmatch.matching.constants import prints

ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)
MOST_WEIGHT = cython.declare(cython.int, prints.MOST_WEIGHT)
TURN = cython.declare(cython.int, 16)  # 256ths of a turn in one group: `most_turn` at least
TURNS_APART = cython.declare(cython.int, 16)  # groups in a turn
TURN_PX2 = cython.declare(cython.double, 400.0)  # a rotation weighs as positions 20 px apart do


@cython.final
@cython.cclass
class PairSet:
    """The pairs of minutiae of two prints, of at most `size` minutiae each.

    ``pair[:, k]`` are the number of the own minutia, that of the other's, and the weight; `count`
    pairs are set. At most `most_pairs`, 64 or fewer, are compared with each other: two agree where
    they lie at most ``sqrt(near² + (near_per_px * d)²)`` pixels off, d apart, and their rotations
    differ by at most `pair_turn_deg`, which is 22.5 or less.
    """

    def __init__(self, size, parameters) -> None:
        p, most = parameters, parameters.most_pairs
        self.count = self.least = 0
        self.most = self.equal = most
        self.near2, self.spread2 = p.near_px * p.near_px, p.near_per_px * p.near_per_px
        self.most_turn = round(p.pair_turn_deg * prints.TURNS / 360)
        self.c = 1.0
        self.s = self.x = self.y = 0.0
        angle = np.arange(256) * (2 * np.pi / 256)
        self.cosine_of = np.cos(angle)
        self.sine_of = np.sin(angle)
        self.pair, self.turned = np.zeros((2, 3, size * size), np.int32)
        self.start = np.zeros(size + 2, np.int32)
        self.row = np.zeros((2, most), np.int32)
        self.a, self.b = np.zeros((2, 2, most))
        self.angle, self.bound = np.zeros((2, most), np.int32)
        self.of_weight = np.zeros(MOST_WEIGHT + 1, np.int32)
        self.of_turn = np.zeros(TURNS_APART, np.uint64)
        self.consistent = np.zeros(most, np.uint64)

    @cython.locals(k=cython.int, entry=cython.int)
    def order_by_own(self, own):
        """Put the pairs in the order of the own minutiae, so many of them, then of the others."""
        # the starts run one ahead while the pairs are sorted, two while they are counted
        for k in range(own + 2):
            self.start[k] = 0
        for k in range(self.count):
            self.start[self.pair[0, k] + 2] += 1
        for k in range(own):
            self.start[k + 2] += self.start[k + 1]
        for k in range(self.count):
            place = self.start[self.pair[0, k] + 1]
            self.start[self.pair[0, k] + 1] += 1
            for entry in range(3):
                self.turned[entry, place] = self.pair[entry, k]
        for entry in range(3):
            for k in range(self.count):
                self.pair[entry, k] = self.turned[entry, k]
        return 0

    @cython.locals(entry=cython.int)
    def keep_best(self):
        """Keep pairs that weigh more than `least`, and the first `equal` that weigh as much."""
        kept: cython.int = 0
        equal: cython.int = self.equal
        if self.count <= self.most:
            return self.count
        for k in range(self.count):
            if self.pair[2, k] < self.least or (self.pair[2, k] == self.least and equal == 0):
                continue
            equal -= self.pair[2, k] == self.least
            for entry in range(3):
                self.pair[entry, kept] = self.pair[entry, k]
            kept += 1
        self.count = kept
        return kept

    @cython.locals(h=cython.Py_ssize_t)
    def locate(self, own_turn, own_xy, first, xy, direction_bin, other_first):
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
            apart = own_turn[own] - cython.cast(cython.int, direction_bin[other])
            self.angle[h] = (-apart if other_first else apart) & 255
            for k in range(2):
                self.a[k, h] = xy[other, k] if other_first else own_xy[own, k]
                self.b[k, h] = own_xy[own, k] if other_first else xy[other, k]
        return 0

    @cython.locals(best=cython.int)
    def consistent_weight(self):
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

    @cython.locals(ax=cython.double, ay=cython.double, bx=cython.double, by=cython.double)
    @cython.locals(mass=cython.double, cosine=cython.double, sine=cython.double)
    def fit(self, weight):
        """Fit a rotation and a shift to the first pairs that agree in them and have this weight.

        It is what `consistent_weight` returned. Return whether there are pairs.
        """
        h: cython.Py_ssize_t = 0
        while h < self.count and (self.bound[h] < weight or self._weight_with(h) < weight):
            h += 1
        if h == self.count:
            return False
        mass = cosine = sine = 0.0
        ax = ay = bx = by = 0.0
        for g in range(self.count):
            if self.consistent[h] >> g & 1:
                w = float(self.pair[2, g])
                mass += w
                ax += w * self.a[0, g]
                ay += w * self.a[1, g]
                bx += w * self.b[0, g]
                by += w * self.b[1, g]
        ax /= mass
        ay /= mass
        bx /= mass
        by /= mass
        for g in range(self.count):
            if self.consistent[h] >> g & 1:
                px, py = self.b[0, g] - bx, self.b[1, g] - by
                qx, qy = self.a[0, g] - ax, self.a[1, g] - ay
                cosine += self.pair[2, g] * (
                    px * qx + py * qy + TURN_PX2 * self.cosine_of[self.angle[g]]
                )
                sine += self.pair[2, g] * (
                    px * qy - py * qx + TURN_PX2 * self.sine_of[self.angle[g]]
                )
        length = sqrt(cosine * cosine + sine * sine)
        if length > 0.0:
            self.c, self.s = cosine / length, sine / length
        self.x = ax - self.c * bx + self.s * by
        self.y = ay - self.s * bx - self.c * by
        return True

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

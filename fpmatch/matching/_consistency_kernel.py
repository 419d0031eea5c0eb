"""Kernel: the pairs of minutiae of two prints that agree in one rotation and one shift."""

import cython
import numpy as np

ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
ONE = cython.declare(cython.ulonglong, 1)
# The product with a single bit has highest six bits that are different for all 64.
WHICH = cython.declare(cython.ulonglong, 0x03F79D71B4CB0A89)
MOST_WEIGHT = cython.declare(cython.int, 18)  # of a pair
TURN = cython.declare(cython.int, 16)  # 256ths of a turn in one group: `most_turn` at least
TURNS_APART = cython.declare(cython.int, 16)  # groups in a turn


def bit_numbers():
    """Return which bit is set, by the highest six bits of its product with `WHICH`."""
    which = np.zeros(64, np.uint8)
    which[[((int(WHICH) << k) & 0xFFFFFFFFFFFFFFFF) >> 58 for k in range(64)]] = range(64)
    return which


@cython.final
@cython.cclass
class PairSet:
    """The pairs of minutiae of two prints, of at most `size` minutiae each.

    ``pair[:, k]`` are the number of the own minutia, that of the other's, and the weight; `count`
    pairs are set. At most `most` pairs, 64 or fewer, are compared with each other: two agree where
    they lie at most ``sqrt(near² + (spread * d)²)`` pixels off, d apart, and their rotations differ
    by at most `most_turn` 256ths of a turn, 16 or fewer.
    """

    def __init__(self, size, most, near, spread, most_turn) -> None:
        self.count = 0
        self.most = most
        self.near2 = near * near
        self.spread2 = spread * spread
        self.most_turn = most_turn
        angle = np.arange(256) * (2 * np.pi / 256)
        self.cosine_of = memoryview(np.cos(angle))
        self.sine_of = memoryview(np.sin(angle))
        self.which = memoryview(bit_numbers())
        self.pair, self.turned = map(memoryview, np.zeros((2, 3, size * size), np.int32))
        self.start = memoryview(np.zeros(size + 2, np.int32))
        self.row = memoryview(np.zeros((2, most), np.int32))
        self.a, self.b = map(memoryview, np.zeros((2, 2, most)))
        self.angle, self.first_of_row, self.counted_for = map(
            memoryview, np.zeros((3, most), np.int32)
        )
        self.of_weight = memoryview(np.zeros(MOST_WEIGHT + 1, np.int32))
        self.of_turn = memoryview(np.zeros(TURNS_APART, np.uint64))
        self.consistent = memoryview(np.zeros(most, np.uint64))

    def add(self, own, other, weight):
        """Add a pair."""
        self.pair[0, self.count] = own
        self.pair[1, self.count] = other
        self.pair[2, self.count] = weight if weight < MOST_WEIGHT else MOST_WEIGHT
        self.count += 1
        return self.count

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

    def keep_best(self):
        """Keep the pairs of the greatest weights, the first of equals; return their number."""
        least = MOST_WEIGHT
        above = kept = 0
        if self.count <= self.most:
            return self.count
        for k in range(MOST_WEIGHT + 1):
            self.of_weight[k] = 0
        for k in range(self.count):
            self.of_weight[self.pair[2, k]] += 1
        while above + self.of_weight[least] < self.most:
            above += self.of_weight[least]
            least -= 1
        equal = self.most - above
        for k in range(self.count):
            if self.pair[2, k] < least or (self.pair[2, k] == least and equal == 0):
                continue
            equal -= self.pair[2, k] == least
            for entry in range(3):
                self.pair[entry, kept] = self.pair[entry, k]
            kept += 1
        self.count = kept
        return kept

    def locate(self, own_row, own_turn, own_xy, first, xy, direction_bin, other_first):
        """Write rows and positions of the pairs in prints A and B, and the rotation of B onto A."""
        of_own = 1 if other_first else 0
        for h in range(self.count):
            own = self.pair[0, h]
            other = first + self.pair[1, h]
            self.row[of_own, h] = own_row[own]
            self.row[1 - of_own, h] = self.pair[1, h]
            g = 0
            while self.row[0, g] != self.row[0, h]:
                g += 1
            self.first_of_row[h] = g
            apart = own_turn[own] - direction_bin[other]
            self.angle[h] = (-apart if other_first else apart) & 255
            for k in range(2):
                self.a[k, h] = xy[other, k] if other_first else own_xy[own, k]
                self.b[k, h] = own_xy[own, k] if other_first else xy[other, k]
        return 0

    def consistent_weight(self):
        """Return the greatest weight of pairs that agree with one of them in rotation and shift.

        Of the pairs of one minutia, of either print, the first counts. Only pairs of about the same
        rotation are compared.
        """
        best = 0
        for h in range(TURNS_APART):
            self.of_turn[h] = 0
        for h in range(self.count):
            self.counted_for[h] = -1
            self.consistent[h] = (ONE << h) & ALL
        for h in range(self.count - 1, -1, -1):
            turn = self.angle[h] // TURN
            left = self.of_turn[turn]
            left |= self.of_turn[(turn + 1) % TURNS_APART]
            left |= self.of_turn[(turn + TURNS_APART - 1) % TURNS_APART]
            self.of_turn[turn] |= (ONE << h) & ALL
            c = self.cosine_of[self.angle[h]]
            s = self.sine_of[self.angle[h]]
            while left:
                lowest = left & ((left ^ ALL) + 1)
                left ^= lowest
                g = self.which[((lowest * WHICH) & ALL) >> 58]
                apart = (self.angle[g] - self.angle[h] + 128) & 255
                if apart < 128 - self.most_turn or apart > 128 + self.most_turn:
                    continue
                dx = self.b[0, g] - self.b[0, h]
                dy = self.b[1, g] - self.b[1, h]
                ex = c * dx - s * dy - (self.a[0, g] - self.a[0, h])
                ey = s * dx + c * dy - (self.a[1, g] - self.a[1, h])
                if ex * ex + ey * ey <= self.near2 + self.spread2 * (dx * dx + dy * dy):
                    self.consistent[h] |= lowest
                    self.consistent[g] |= (ONE << h) & ALL
        for h in range(self.count):
            total = 0
            last = -1
            left = self.consistent[h]
            while left:
                lowest = left & ((left ^ ALL) + 1)
                left ^= lowest
                g = self.which[((lowest * WHICH) & ALL) >> 58]
                if self.row[1, g] == last or self.counted_for[self.first_of_row[g]] == h:
                    continue
                last = self.row[1, g]
                self.counted_for[self.first_of_row[g]] = h
                total += self.pair[2, g]
            best = total if total > best else best
        return best


if not cython.compiled:
    from fpmatch.matching.numpy_forms import descriptors

    PairSet.locate = descriptors.locate

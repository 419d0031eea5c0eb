"""Kernel: bit descriptors of prints in few bytes, unpacked one print after the other to be scored.

A minutia takes three words of 32 bits, and more for its neighbours. The first is x and y in whole
steps from the print's origin (10 bits each, from the lowest on), direction (8) and number of
neighbours (4). The next two are twelve bins of orientation (5 bits each), and how the words of
neighbours follow (4). Where these are 15, they follow as they are, two in 32 bits. Else they are
those that follow from the positions and directions of neighbours, four in 32 bits: each has the
number of a minutia (three bits, and three after the next bit), and the two bits of a word that does
not count in a grid (the fourth and the eighth). Of so many of them as the four bits say, the last
ones, the relative direction lies just below what the steps of direction would make it. Minutiae
without a word are left out.
"""

import cython
import numpy as np

NEIGHBOUR_WORDS = cython.declare(cython.int, 12)
ORIENTATION_WORDS = cython.declare(cython.int, 12)
ROOM = cython.declare(cython.int, 64)  # minutiae that are encoded of a print
PLACES = cython.declare(cython.int, 128)  # more than a byte without two bits
# Of a word: that it does not count in the first grid, nor in the second; of no neighbour, both.
NOWHERE = cython.declare(cython.int, 0x8800)
HEAD = cython.declare(cython.Py_ssize_t, 3)  # words of 32 bits before the neighbours
MOST = cython.declare(cython.Py_ssize_t, 9)  # of a minutia in all
AS_THEY_ARE = cython.declare(cython.int, 15)
QUARTER = cython.declare(cython.int, 64)  # of a turn: where the sectors begin (`APART`)
MIDDLE = cython.declare(cython.float, 16.0)  # of the grid, in half cells
DAMAGED = cython.declare(cython.int, -1)
EXACT = 2.0**15  # steps of a cosine
LOW_32 = cython.declare(cython.ulonglong, 0xFFFFFFFF)
# steps in which eight times five bits are spread over the bytes of a word
LOW_20 = cython.declare(cython.ulonglong, 0x00000000000FFFFF)
LOW_10 = cython.declare(cython.ulonglong, 0x000003FF000003FF)
LOW_5 = cython.declare(cython.ulonglong, 0x001F001F001F001F)


def place_of(number):
    """Return the bits of a byte that are the number of a minutia."""
    return (number & 7) | (number & 56) << 1


def word_of(dx, dy, c, s, turn):
    """Return the word of a neighbour so many pixels off, by the direction (c, s) of the minutia.

    `turn` is its relative direction, a quarter of a turn on, in 256ths. A neighbour outside of the
    grid has any word.
    """
    column = int(c * dx + s * dy + MIDDLE)
    row = int(c * dy - s * dx + MIDDLE)
    # the highest four of five bits make the cell, the lowest the step to the second grid's cell
    cell = ((row * 0x4040) & 0x4780) | ((column * 0x2004) & 0x2078)
    return cell | ((turn >> 5) & 7) | ((turn << 8) & 0x1000)


@cython.final
@cython.cclass
class DescriptorWriter:
    """Write the minutiae of prints as bytes, for one thread."""

    def __init__(self) -> None:
        self.cosine, self.sine = map(memoryview, unit_vectors())
        self.content = memoryview(np.zeros(ROOM * MOST, np.uint32))
        self.number = memoryview(np.zeros(1 << 16, np.int32))
        self.used = 0

    def write(self, places, whole, direction_bin, neighbour, neighbour_bits, orientation_bins):
        """Write the minutiae that have words; return how many words of `content` they take.

        `places` are their whole steps from the origin, which are pixels where `whole`; `neighbour`
        is which minutiae are the neighbours.
        """
        kept = 0
        for i in range(neighbour_bits.shape[0]):
            self.number[i] = -1
            for k in range(NEIGHBOUR_WORDS):
                if neighbour_bits[i, k] & NOWHERE != NOWHERE and kept < ROOM:
                    self.number[i] = kept
                    kept += 1
                    break
        self.used = 0
        for i in range(neighbour_bits.shape[0]):
            if self.number[i] >= 0:
                self._write_one(
                    i, places, whole, direction_bin, neighbour, neighbour_bits, orientation_bins
                )
        return self.used

    def _write_one(
        self, i, places, whole, direction_bin, neighbour, neighbour_bits, orientation_bins
    ):
        """Write a minutia."""
        at = self.used + HEAD
        count = 0
        below = 0 if whole else AS_THEY_ARE
        for k in range(MOST - HEAD):
            self.content[at + k] = 0
        c = self.cosine[direction_bin[i]]
        s = self.sine[direction_bin[i]]
        # first the neighbours in the direction of their steps, then those just below it
        for lower in range(2):
            for k in range(NEIGHBOUR_WORDS):
                word = neighbour_bits[i, k]
                if word & NOWHERE == NOWHERE or below == AS_THEY_ARE:
                    continue
                j = neighbour[i, k]
                turn = direction_bin[j] - direction_bin[i] + QUARTER
                dx = places[j, 0] - places[i, 0]
                dy = places[j, 1] - places[i, 1]
                apart = (word_of(dx, dy, c, s, turn & 255) ^ word) & ~NOWHERE
                if lower and apart == 0:
                    continue
                if apart:
                    if not lower:
                        continue
                    apart = (word_of(dx, dy, c, s, (turn - 1) & 255) ^ word) & ~NOWHERE
                    below += 1
                if apart or self.number[j] < 0:
                    below = AS_THEY_ARE
                    continue
                bits = place_of(self.number[j]) | (word & NOWHERE) >> 8
                self.content[at + count // 4] |= bits << (8 * (count % 4))
                count += 1
        if below == AS_THEY_ARE:
            count = 0
            for k in range(MOST - HEAD):
                self.content[at + k] = 0
            for k in range(NEIGHBOUR_WORDS):
                word = neighbour_bits[i, k]
                if word & NOWHERE != NOWHERE:
                    bits = word
                    self.content[at + count // 2] |= bits << (16 * (count % 2))
                    count += 1
        bins = below
        bins <<= 60
        for k in range(ORIENTATION_WORDS):
            bins |= cython.cast(cython.ulonglong, orientation_bins[i, k]) << (5 * k)
        head = count
        head = places[i, 0] | places[i, 1] << 10 | direction_bin[i] << 20 | head << 28
        self.content[self.used] = head
        self.content[self.used + 1] = bins & LOW_32
        self.content[self.used + 2] = bins >> 32
        self.used = at + ((count + 1) // 2 if below == AS_THEY_ARE else (count + 3) // 4)
        return 0


@cython.final
@cython.cclass
class DescriptorReader:
    """Read the arrays of `fpmatch.matching.packed_descriptors.PackedDescriptors`, for one thread.

    Any bytes may be in them: what was never packed has no score, or any, and no index leads out of
    an array.
    """

    def __init__(self, many) -> None:
        self.cosine, self.sine = map(memoryview, unit_vectors())
        self.start = memoryview(many.content_start)
        self.content = memoryview(many.content)
        self.origin = memoryview(many.origin)
        self.step = memoryview(many.step)
        self.has_flow = memoryview(many.has_flow)
        self.xy = memoryview(np.zeros((ROOM, 2), np.float32))
        self.direction_bin = memoryview(np.zeros(ROOM, np.uint8))
        self.neighbour_bits = memoryview(np.zeros((ROOM, NEIGHBOUR_WORDS), np.uint16))
        bins = np.zeros((ROOM, ORIENTATION_WORDS), np.uint8)
        self.orientation_bins = memoryview(bins)
        self.four_bins = memoryview(bins.view(np.uint32))  # the same: written four at a time
        self.words_at = memoryview(np.zeros(ROOM, np.int64))
        self.head, self.count, self.below = map(memoryview, np.zeros((3, ROOM), np.int32))
        self.placed = memoryview(np.zeros(PLACES, np.int32))  # heads, where bytes say
        self.filled = 0
        self.near = memoryview(np.zeros(NEIGHBOUR_WORDS, np.int32))
        self.byte = memoryview(np.zeros(NEIGHBOUR_WORDS, np.uint32))

    def unpack(self, k):
        """Unpack print k; return its number of minutiae, or -1 where it was never packed."""
        at = self.start[k]
        end = self.start[k + 1]
        x = self.origin[k, 0]
        y = self.origin[k, 1]
        step = float(1 << (self.step[k] & 15))
        n = 0
        while at < end:
            if n == ROOM or end - at < HEAD:
                return DAMAGED
            head = self.content[at]
            last = self.content[at + 2]
            self.head[n] = self.placed[place_of(n)] = head & 0xFFFFFFF
            self.count[n] = head >> 28
            self.below[n] = last >> 28
            self.words_at[n] = at + HEAD
            self.xy[n, 0] = x + step * (self.head[n] & 1023)
            self.xy[n, 1] = y + step * (self.head[n] >> 10 & 1023)
            self._spread(n, self.content[at + 1] | last << 32)
            # as they are: two in 32 bits; else four
            at += HEAD + (self.count[n] + 3) // 4
            if self.below[n] == AS_THEY_ARE:
                at += (self.count[n] + 1) // 2 - (self.count[n] + 3) // 4
            if self.count[n] > 12 or at > end:
                return DAMAGED
            n += 1
        for i in range(n, self.filled):
            self.placed[place_of(i)] = 0
        self.filled = n
        for i in range(n):
            self.direction_bin[i] = self.head[i] >> 20
        self._write_words(n)
        return n

    def score(self, tables, which, weight):
        """Fill `weight` with the scores of the prints `which` against that in the tables.

        It is -1 of a print that was never packed. Other threads may run meanwhile.
        """
        with cython.nogil:
            for t in range(which.shape[0]):
                k = which[t]
                n = self.unpack(k)
                weight[t] = n
                if n >= 0:
                    weight[t] = tables.score(
                        0,
                        n,
                        self.xy,
                        self.direction_bin,
                        self.neighbour_bits,
                        self.orientation_bins,
                        self.has_flow[k],
                        False,
                    )
        return 0

    def _write_words(self, n):
        """Write the words of so many minutiae: as they are, or as they follow from neighbours."""
        for i in range(n):
            at = self.words_at[i]
            count = self.count[i]
            if self.below[i] == AS_THEY_ARE:
                for k in range((count + 1) // 2):
                    four = self.content[at + k]
                    self.neighbour_bits[i, 2 * k] = four & 0xFFFF
                    self.neighbour_bits[i, 2 * k + 1] = four >> 16
            else:
                own = self.head[i]
                x = own & 1023
                y = own >> 10 & 1023
                turn = (own >> 20) - QUARTER
                c = self.cosine[own >> 20]
                s = self.sine[own >> 20]
                lower = count - self.below[i]
                for k in range((count + 3) // 4):
                    four = self.content[at + k]
                    for m in range(4):
                        self.byte[4 * k + m] = four
                        self.near[4 * k + m] = self.placed[four & 0x77]
                        four >>= 8
                # a loop that compilers turn into one over four neighbours at once
                for k in range(NEIGHBOUR_WORDS):
                    other = self.near[k]
                    flags = (self.byte[k] << 8) & 0x8800
                    self.near[k] = flags | word_of(
                        (other & 1023) - x,
                        (other >> 10 & 1023) - y,
                        c,
                        s,
                        (other >> 20) - turn + ((lower - k - 1) >> 31),
                    )
                for k in range(12):
                    self.neighbour_bits[i, k] = self.near[k]
            for k in range(count, 12):
                self.neighbour_bits[i, k] = NOWHERE
        return 0

    def _spread(self, n, bins):
        """Write the bins of orientation of minutia n."""
        last = bins >> 40
        bins = (bins & LOW_20) | ((bins >> 20 & LOW_20) << 32)
        bins = (bins & LOW_10) | ((bins >> 10 & LOW_10) << 16)
        bins = (bins & LOW_5) | ((bins >> 5 & LOW_5) << 8)
        last = (last & 1023) | ((last >> 10 & 1023) << 16)
        last = (last & LOW_5) | ((last >> 5 & LOW_5) << 8)
        self.four_bins[n, 0] = bins & LOW_32
        self.four_bins[n, 1] = bins >> 32
        self.four_bins[n, 2] = last
        return 0


def unit_vectors():
    """Return cosine and sine, shape (2, 256), of all steps of direction, in half cells a pixel.

    They are rounded, so that products with whole pixels within the grid, and their sums, are exact.
    """
    angle = np.arange(256) * (2 * np.pi / 256)
    exact = np.rint(np.stack([np.cos(angle), np.sin(angle)]) * EXACT) / EXACT
    return (exact / 8.0).astype(np.float32)

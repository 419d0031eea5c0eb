# mypy: ignore-errors
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

if cython.compiled:
    from cython.cimports.fpmatch.matching.prints._kernels._descriptor_words import (
        AS_THEY_ARE,
        DAMAGED,
        HEAD,
        LINE,
        MOST,
        NEIGHBOUR_WORDS,
        NOT_FIRST,
        NOT_SECOND,
        NOWHERE,
        ORIENTATION_WORDS,
        PLACES,
        QUARTER,
        ROOM,
        prefetch,
    )
else:
    NEIGHBOUR_WORDS, ORIENTATION_WORDS, ROOM, PLACES = 12, 12, 64, 256
    NOWHERE, NOT_FIRST, NOT_SECOND = 0x8800, 1 << 28, 1 << 29
    HEAD, MOST, AS_THEY_ARE, QUARTER, DAMAGED = 3, 9, 15, 64, -1

MIDDLE = cython.declare(cython.float, 16.0)  # of the grid, in half cells
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
    column: cython.int = int(c * dx + s * dy + MIDDLE)
    row: cython.int = int(c * dy - s * dx + MIDDLE)
    # the highest four of five bits make the cell, the lowest the step to the second grid's cell
    cell: cython.int = ((row * 0x4040) & 0x4780) | ((column * 0x2004) & 0x2078)
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

    @cython.locals(k=cython.Py_ssize_t)
    def write(self, places, whole, direction_bin, neighbour, neighbour_bits, orientation_bins):
        """Write the minutiae that have words; return how many words of `content` they take.

        `places` are their whole steps from the origin, which are pixels where `whole`; `neighbour`
        is which minutiae are the neighbours.
        """
        kept: cython.int = 0
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

    @cython.locals(k=cython.Py_ssize_t, lower=cython.int)
    def _write_one(
        self, i, places, whole, direction_bin, neighbour, neighbour_bits, orientation_bins
    ):
        """Write a minutia."""
        at = self.used + HEAD
        count: cython.int = 0
        below: cython.longlong = 0 if whole else AS_THEY_ARE
        for k in range(MOST - HEAD):
            self.content[at + k] = 0
        c = self.cosine[direction_bin[i]]
        s = self.sine[direction_bin[i]]
        # first the neighbours in the direction of their steps, then those just below it
        for lower in range(2):
            for k in range(NEIGHBOUR_WORDS):
                word: cython.int = neighbour_bits[i, k]
                if word & NOWHERE == NOWHERE or below == AS_THEY_ARE:
                    continue
                j: cython.Py_ssize_t = neighbour[i, k]
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
                bits: cython.uint = place_of(self.number[j]) | (word & NOWHERE) >> 8
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
        head: cython.ulonglong = count
        head = places[i, 0] | places[i, 1] << 10 | direction_bin[i] << 20 | head << 28
        self.content[self.used] = head
        self.content[self.used + 1] = bins & LOW_32
        self.content[self.used + 2] = bins >> 32
        self.used = at + ((count + 1) // 2 if below == AS_THEY_ARE else (count + 3) // 4)
        return 0


@cython.final
@cython.cclass
class DescriptorReader:
    """Read the arrays of `stored_descriptors.StoredDescriptors`, for one thread.

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
        bits = np.zeros((ROOM, NEIGHBOUR_WORDS), np.uint16)
        self.neighbour_bits, self.all_bits = memoryview(bits), memoryview(bits.ravel())
        bins = np.zeros((ROOM, ORIENTATION_WORDS), np.uint8)
        self.orientation_bins = memoryview(bins)
        self.four_bins = memoryview(bins.view(np.uint32))  # the same: written four at a time
        self.words_at = memoryview(np.zeros(ROOM, np.int64))
        self.head, self.count, self.below, self.follow, self.as_they_are = map(
            memoryview, np.zeros((5, ROOM), np.int32)
        )
        self.placed = memoryview(np.zeros(PLACES, np.int32))  # heads, where bytes say
        self.filled = 0
        near = np.zeros((ROOM, NEIGHBOUR_WORDS), np.int32)  # neighbours, then words
        self.near, self.all_near = memoryview(near), memoryview(near.ravel())
        self.two_words = memoryview(np.zeros(NEIGHBOUR_WORDS // 2, np.uint32))

    @cython.locals(n=cython.int, follow=cython.int, as_they_are=cython.int, m=cython.Py_ssize_t)
    def unpack(self, k):
        """Unpack print k; return its number of minutiae, or -1 where it was never packed."""
        at: cython.Py_ssize_t = self.start[k]
        end: cython.Py_ssize_t = self.start[k + 1]
        x = self.origin[k, 0]
        y = self.origin[k, 1]
        step: cython.float = float(1 << (self.step[k] & 15))
        n = follow = as_they_are = 0
        while at < end:
            if n == ROOM or end - at < HEAD:
                return self._damaged(n)
            head: cython.uint = self.content[at]
            last: cython.ulonglong = self.content[at + 2]
            count: cython.int = head >> 28
            self.below[n] = last >> 28
            self._spread(n, self.content[at + 1] | last << 32)
            at += HEAD
            self.words_at[n] = at
            self.count[n] = count
            # either list goes on where this one is in it
            self.follow[follow] = self.as_they_are[as_they_are] = n
            follows: cython.int = (self.below[n] - AS_THEY_ARE) >> 31 & 1
            follow += follows
            as_they_are += 1 - follows
            at += (count + 1 + 2 * follows) >> (1 + follows)  # two, or four, in 32 bits
            if count > NEIGHBOUR_WORDS or at > end:
                return self._damaged(n)
            head &= 0xFFFFFFF
            self.head[n] = head
            self.direction_bin[n] = head >> 20
            self.xy[n, 0] = x + step * (head & 1023)
            self.xy[n, 1] = y + step * (head >> 10 & 1023)
            place = place_of(n)
            self.placed[place] = head
            self.placed[place | 0x08] = head | NOT_FIRST
            self.placed[place | 0x80] = head | NOT_SECOND
            self.placed[place | 0x88] = head | NOT_FIRST | NOT_SECOND
            n += 1
        self._forget(n)
        for m in range(follow):
            self._find_neighbours(self.follow[m])
        for m in range(as_they_are):
            self._copy_words(self.as_they_are[m])
        for m in range(follow):
            self._write_words(self.follow[m])
        for m in range(as_they_are):
            self._omit_words(self.as_they_are[m])
        for m in range(n * NEIGHBOUR_WORDS):
            self.all_bits[m] = self.all_near[m]
        return n

    def _damaged(self, n):
        """Return that a print was never packed, of which n minutiae were placed."""
        self.filled = max(self.filled, n)
        return DAMAGED

    def _forget(self, n):
        """Leave only n minutiae placed."""
        for i in range(n, self.filled):
            place = place_of(i)
            self.placed[place] = self.placed[place | 0x08] = 0
            self.placed[place | 0x80] = self.placed[place | 0x88] = 0
        self.filled = n
        return 0

    def score(self, tables, which, weight):
        """Fill `weight` with the scores of the prints `which` against that in the tables.

        It is -1 of a print that was never packed. Other threads may run meanwhile.
        """
        with cython.nogil:
            for t in range(which.shape[0]):
                k: cython.Py_ssize_t = which[t]
                if cython.compiled and t + 1 < which.shape[0]:
                    self._fetch(which[t + 1])
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

    def _fetch(self, k):
        """Fetch the bytes of print k into the cache; those of another print may lie far off."""
        at: cython.Py_ssize_t = self.start[k]
        while at < self.start[k + 1]:
            prefetch(cython.address(self.content[at]))
            at += LINE
        return 0

    @cython.locals(k=cython.int)
    def _copy_words(self, i):
        """Copy the words of minutia i, which are as they are."""
        at: cython.Py_ssize_t = self.words_at[i]
        count = self.count[i]
        if at + NEIGHBOUR_WORDS // 2 > self.content.shape[0]:  # fewer are left of all prints
            for k in range((count + 1) // 2):
                self.two_words[k] = self.content[at + k]
        else:
            for k in range(NEIGHBOUR_WORDS // 2):
                self.two_words[k] = self.content[at + k]
        for k in range(NEIGHBOUR_WORDS // 2):
            self.near[i, 2 * k] = self.two_words[k] & 0xFFFF
            self.near[i, 2 * k + 1] = self.two_words[k] >> 16
        return 0

    def _omit_words(self, i):
        """Omit what stands after the words of minutia i."""
        count = self.count[i]
        for k in range(NEIGHBOUR_WORDS):
            counts: cython.int = (k - count) >> 31
            self.near[i, k] = (self.near[i, k] & counts) | (NOWHERE & ~counts)
        return 0

    @cython.locals(k=cython.int)
    def _find_neighbours(self, i):
        """Find the neighbours of minutia i, from whose places its words follow."""
        at: cython.Py_ssize_t = self.words_at[i]
        for k in range((self.count[i] + 3) // 4):
            four = self.content[at + k]
            self.near[i, 4 * k] = self.placed[four & 255]
            self.near[i, 4 * k + 1] = self.placed[four >> 8 & 255]
            self.near[i, 4 * k + 2] = self.placed[four >> 16 & 255]
            self.near[i, 4 * k + 3] = self.placed[four >> 24]
        return 0

    def _write_words(self, i):
        """Write the words of minutia i that follow from the places of its neighbours."""
        own = self.head[i]
        x: cython.int = own & 1023
        y: cython.int = own >> 10 & 1023
        turn: cython.int = (own >> 20) - QUARTER
        c = self.cosine[own >> 20]
        s = self.sine[own >> 20]
        count = self.count[i]
        lower = count - self.below[i]
        # a loop that compilers turn into one over four neighbours at once
        for k in range(NEIGHBOUR_WORDS):
            other = self.near[i, k]
            counts: cython.int = (k - count) >> 31
            word: cython.int = (other >> 17 & 0x0800) | (other >> 14 & 0x8000)
            word |= word_of(
                (other & 1023) - x,
                (other >> 10 & 1023) - y,
                c,
                s,
                (other >> 20) - turn + ((lower - k - 1) >> 31),
            )
            self.near[i, k] = (word & counts) | (NOWHERE & ~counts)
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

"""Kernel: bit descriptors of prints in few bytes, unpacked one print after the other to be scored.

A minutia takes 12 bytes, little-endian, and two for each word of a neighbour: x and y above the
print's origin (10 bits each, in its step), direction (8) and number of words (4); twelve bins of
orientation (5 bits each), the first lowest; the words. Minutiae without a word are left out.
"""

import cython
import numpy as np

NEIGHBOUR_WORDS = cython.declare(cython.int, 12)
ORIENTATION_WORDS = cython.declare(cython.int, 12)
ROOM = cython.declare(cython.int, 64)  # minutiae that are encoded of a print
NOWHERE = cython.declare(cython.int, 0x8800)  # the word of no neighbour
PLACE = cython.declare(cython.uint, 1023)
PLACE_BITS = cython.declare(cython.int, 10)
HEAD = cython.declare(cython.Py_ssize_t, 12)  # bytes before the words
DAMAGED = cython.declare(cython.int, -1)
# steps in which eight times five bits are spread over the bytes of a word
LOW_20 = cython.declare(cython.ulonglong, 0x00000000000FFFFF)
LOW_10 = cython.declare(cython.ulonglong, 0x000003FF000003FF)
LOW_5 = cython.declare(cython.ulonglong, 0x001F001F001F001F)


@cython.final
@cython.cclass
class DescriptorReader:
    """Read the arrays of `fpmatch.matching.packed_descriptors.PackedDescriptors`, for one thread.

    Any bytes may be in them: what was never packed is unpacked as far as it has a meaning, and no
    index leads out of an array.
    """

    def __init__(self, many) -> None:
        self.start = memoryview(many.content_start)
        self.content = memoryview(many.content)
        self.origin = memoryview(many.origin)
        self.step = memoryview(many.step)
        self.has_flow = memoryview(many.has_flow)
        self.xy = memoryview(np.zeros((ROOM, 2), np.float32))
        self.direction_bin = memoryview(np.zeros(ROOM, np.uint8))
        self.neighbour_bits = memoryview(np.zeros((ROOM, NEIGHBOUR_WORDS), np.uint16))
        self.orientation_bins = memoryview(np.zeros((ROOM, ORIENTATION_WORDS), np.uint8))

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
            head = self._bits(at, 4)
            count = head >> 28
            if count > NEIGHBOUR_WORDS or end - at < HEAD + 2 * count:
                return DAMAGED
            self.xy[n, 0] = x + step * (head & PLACE)
            self.xy[n, 1] = y + step * ((head >> PLACE_BITS) & PLACE)
            self.direction_bin[n] = (head >> (2 * PLACE_BITS)) & 255
            self._spread(n, self._bits(at + 4, 8))
            at += HEAD
            for i in range(count):
                self.neighbour_bits[n, i] = self.content[at] | (self.content[at + 1] << 8)
                at += 2
            for i in range(count, NEIGHBOUR_WORDS):
                self.neighbour_bits[n, i] = NOWHERE
            n += 1
        return n

    def score(self, tables, which, weight):
        """Fill `weight` with the scores of the prints `which` against that in the tables.

        It is -1 of a print that was never packed.
        """
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

    def _bits(self, at, count):
        """Return so many bytes as a number."""
        found = 0
        for i in range(count):
            found |= cython.cast(cython.ulonglong, self.content[at + i]) << (8 * i)
        return found

    def _spread(self, n, bins):
        """Write the bins of orientation of minutia n."""
        last = bins >> 40
        bins = (bins & LOW_20) | ((bins >> 20 & LOW_20) << 32)
        bins = (bins & LOW_10) | ((bins >> 10 & LOW_10) << 16)
        bins = (bins & LOW_5) | ((bins >> 5 & LOW_5) << 8)
        last = (last & 1023) | ((last >> 10 & 1023) << 16)
        last = (last & LOW_5) | ((last >> 5 & LOW_5) << 8)
        for i in range(8):
            self.orientation_bins[n, i] = (bins >> (8 * i)) & 255
        for i in range(4):
            self.orientation_bins[n, 8 + i] = (last >> (8 * i)) & 255
        return 0

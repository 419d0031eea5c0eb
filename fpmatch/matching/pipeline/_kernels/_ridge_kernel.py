# mypy: ignore-errors
"""Kernel: the correlation of the ridges of two prints whose minutiae are aligned.

A cell of a print has a binary ridge image of 8 by 8 bits: bit ``8 * row + column`` is set on a
ridge. Each cell is displaced by the mesh of the paired minutiae around it (`_pair_mesh_kernel`).
"""

import cython
import numpy as np
from cython.cimports.libc.math import ceil, floor

from fpmatch.matching.constants import *

FEW = cython.declare(cython.Py_ssize_t, len(FEW_SAMPLES))
MANY = cython.declare(cython.Py_ssize_t, len(SAMPLES))
LEFT_HALF = cython.declare(cython.ulonglong, 0x0F0F0F0F0F0F0F0F)  # of the bits of each row
LANE = cython.declare(cython.int, 12)  # bits of a count: a word has one for each shift along a row
MOST_COUNT = cython.declare(cython.ulonglong, 0xFFF)
TOPS = cython.declare(cython.ulonglong, 0x800800800800800)  # of the counts of a word
FIVE = cython.declare(cython.ulonglong, 31)


@cython.final
@cython.cclass
class RidgeCorrelator:
    """Compare the ridges of two prints, cell by cell, where they lie on one another.

    A cell of A is in both prints where its middle lies in B; it is compared with the cells that
    touch it, where at least four of these nine are in both. Eight of its bits, 32 where the smaller
    print is small, are looked up in B, which has a valley wherever it has no cell; of all shifts,
    that under which the most of them agree counts.

    At most `capacity` pairs of minutiae are taken. After `compare`, `cells` is the number of cells
    that could be compared, `correlation` their mean correlation, -1 to 1.
    """

    def __init__(self, capacity) -> None:
        bits, k = np.arange(32, dtype=np.uint64)[:, np.newaxis], np.arange(8, dtype=np.uint64)
        # five bits, one a count
        self.spread = ((bits >> k[:SHIFTS] & 1) << LANE * k[:SHIFTS]).sum(axis=1)
        self.sample = np.array(SAMPLES, np.int32) @ np.array([BITS_ALONG, 1], np.int32)
        self.offset = np.zeros((2, MANY))
        self.ridge_image = np.zeros(4 * MOST_CELLS, np.uint64)
        self.agreeing, self.wide = np.zeros((2, MOST_CELLS, SHIFTS), np.uint64)
        self.both = np.zeros(MOST_CELLS, np.uint8)
        self.drift = np.zeros((MOST_CELLS, 2))
        self.vertex = np.zeros((capacity + FRAME, 2))

    def compare(self, a, b, mesh, c, s, x, y):
        """Align A with B, warped by the mesh of pairs, if any; return the number of cells compared.

        The mesh is built by the same transform. Where a print area has more than 16,384 cells,
        including its border, none are compared.
        """
        if not self._take(a, b, c, s, x, y):
            return 0
        if mesh is not None:
            self._displace(a, mesh)
        return self._correlate(a, b)

    @cython.locals(k=cython.Py_ssize_t)
    def _take(self, a, b, c, s, x, y):
        """Take two prints and a transform, no block displaced; return whether both show ridges.

        B's ridge image gets two empty cells around it. It has 8 by 8 bits from each half of a cell
        on, so that the window of shifts of a sample always lies in one of its entries.
        """
        wide: cython.Py_ssize_t = 2 * (b.columns + 4)
        size: cython.Py_ssize_t = 2 * (b.rows + 4) * wide
        self.correlation = 0.0
        self.cells = 0
        if not (a.has_ridges and b.has_ridges) or size > 4 * MOST_CELLS:
            return False
        if (a.rows + 2) * cython.cast(cython.Py_ssize_t, a.columns + 2) > MOST_CELLS:
            return False
        self.c, self.s, self.x, self.y = c, s, x, y
        self.samples = MANY if smaller_area(a, b) <= SMALL_AREA_PX2 else FEW
        for k in range(size):
            self.ridge_image[k] = 0
        for row in range(b.rows):
            for column in range(b.columns):
                self.ridge_image[2 * (row + 2) * wide + 2 * (column + 2)] = b.ridges[row, column]
        for row in range(0, 2 * (b.rows + 3), 2):
            for column in range(1, 2 * (b.columns + 3), 2):
                k = row * wide + column
                left = (self.ridge_image[k - 1] >> 4) & LEFT_HALF
                self.ridge_image[k] = left | ((self.ridge_image[k + 1] << 4) & ~LEFT_HALF)
        for row in range(1, 2 * (b.rows + 3), 2):
            for column in range(2 * (b.columns + 3)):
                k = row * wide + column
                upper = self.ridge_image[k - wide] >> 32
                self.ridge_image[k] = upper | (self.ridge_image[k + wide] << 32)
        bit = a.step / BITS_ALONG
        per_bit = BITS_ALONG / b.step
        for k in range(self.samples):
            px = (float(self.sample[k] % BITS_ALONG) - 3.5) * bit
            py = -(float(self.sample[k] // BITS_ALONG) - 3.5) * bit
            self.offset[0, k] = (c * px - s * py) * per_bit
            self.offset[1, k] = -(s * px + c * py) * per_bit
        self.blocks = (a.columns + 1) // 2
        for k in range(((a.rows + 1) // 2) * self.blocks):
            self.drift[k, 0] = self.drift[k, 1] = 0.0
        return True

    @cython.locals(r=cython.Py_ssize_t, row=cython.int, column=cython.int)
    def _correlate(self, a, b):
        """Compare the cells where they are displaced to; return how many could be compared."""
        wide = a.columns + 2
        half = 0.5 * a.step - 0.5  # a pixel's middle has whole coordinates
        for k in range((a.rows + 2) * wide):
            self.both[k] = 0
            for r in range(SHIFTS):
                self.agreeing[k, r] = 0
        for row in range(a.rows):
            for column in range(a.columns):
                if a.cell[row, column]:
                    px = (a.first_column + column) * a.step + half
                    py = -((a.first_row + row) * a.step + half)
                    k = (row // 2) * self.blocks + column // 2
                    x = self.c * px - self.s * py + self.x + self.drift[k, 0]
                    y = self.s * px + self.c * py + self.y + self.drift[k, 1]
                    if b.contains(x, y):
                        own = (row + 1) * wide + column + 1
                        self._count(b, own, a.ridges[row, column], x, y)
        for k in range(1, (a.rows + 2) * wide - 1):
            for r in range(SHIFTS):
                self.wide[k, r] = self.agreeing[k - 1, r] + self.agreeing[k, r]
                self.wide[k, r] += self.agreeing[k + 1, r]
        for row in range(a.rows):
            for column in range(a.columns):
                own = (row + 1) * wide + column + 1
                if self.both[own]:
                    self.correlation += self._best_shift(own, wide)
        if self.cells > 0:
            self.correlation = self.correlation / self.cells
        return self.cells

    @cython.locals(p=cython.Py_ssize_t, q=cython.Py_ssize_t, r=cython.Py_ssize_t)
    def _displace(self, a, mesh):
        """Write how far from the transform the mesh moves each block of two by two cells.

        A block is moved as its middle is; a triangle of the mesh is mapped affinely. A pair lies
        halfway between the partner and where its ring predicts it: so noise is less.
        """
        rows: cython.int = (a.rows + 1) // 2
        columns: cython.int = (a.columns + 1) // 2
        side = 2.0 * a.step
        # the middle of the first block
        left = (a.first_column + 1.0) * a.step
        top = -(a.first_row + 1.0) * a.step
        for k in range(mesh.vertices):
            i: cython.Py_ssize_t = mesh.owner[k]
            self.vertex[k, 0], self.vertex[k, 1] = mesh.bx[k], mesh.by[k]
            if i >= 0:
                self.vertex[k, 0] = 0.5 * (mesh.bx[k] + mesh.predicted[0, i])
                self.vertex[k, 1] = 0.5 * (mesh.by[k] + mesh.predicted[1, i])
        for t in range(mesh.triangles):
            p, q, r = mesh.corner[t, 0], mesh.corner[t, 1], mesh.corner[t, 2]
            if mesh.owner[p] < 0 and mesh.owner[q] < 0 and mesh.owner[r] < 0:
                continue
            px, py = mesh.ax[p], mesh.ay[p]
            ux, uy = mesh.ax[q] - px, mesh.ay[q] - py
            vx, vy = mesh.ax[r] - px, mesh.ay[r] - py
            area = ux * vy - uy * vx
            low, high = px + min(ux, vx, 0.0), px + max(ux, vx, 0.0)
            first_column = self._within(ceil((low - left) / side), columns)
            last_column = self._within(floor((high - left) / side) + 1.0, columns)
            low, high = py + min(uy, vy, 0.0), py + max(uy, vy, 0.0)
            first_row = self._within(ceil((top - high) / side), rows)
            last_row = self._within(floor((top - low) / side) + 1.0, rows)
            for row in range(first_row, last_row):
                for column in range(first_column, last_column):
                    low = left + column * side - px
                    high = top - row * side - py
                    at_q = low * vy - high * vx
                    at_r = ux * high - uy * low
                    # one test of all three: a branch for each would go either way as often
                    if (at_q >= 0.0) & (at_r >= 0.0) & (at_q + at_r <= area):
                        k = row * columns + column
                        at_q, at_r = at_q / area, at_r / area
                        low, high = low + px, high + py
                        self.drift[k, 0] = self._mapped(0, p, q, r, at_q, at_r)
                        self.drift[k, 0] -= self.c * low - self.s * high + self.x
                        self.drift[k, 1] = self._mapped(1, p, q, r, at_q, at_r)
                        self.drift[k, 1] -= self.s * low + self.c * high + self.y
        return 0

    def _mapped(self, axis, p, q, r, at_q, at_r):
        """Return x or y of a place in B, given its share of two sides of a triangle."""
        origin = self.vertex[p, axis]
        place = origin + at_q * (self.vertex[q, axis] - origin)
        return place + at_r * (self.vertex[r, axis] - origin)

    def _within(self, line, lines):
        """Return a row or column of blocks, one of the first or the last where it lies beyond."""
        if not line > 0.0:
            return 0
        return int(line) if line < lines else lines

    @cython.locals(part=cython.Py_ssize_t, k=cython.Py_ssize_t)
    @cython.locals(ones=cython.ulonglong, twos=cython.ulonglong)
    @cython.locals(fours=cython.ulonglong, eights=cython.ulonglong)
    def _count(self, b, own, ridges, x, y):
        """Count the samples of a cell, its middle at a place of B, that agree at each shift."""
        wide: cython.Py_ssize_t = 2 * (b.columns + 4)
        per_bit = BITS_ALONG / b.step
        # the window of shifts begins before the sample, the ridge image two cells before B
        middle_u = (x + 0.5) * per_bit - BITS_ALONG * (b.first_column - 2.0) - REACH
        middle_v = (0.5 - y) * per_bit - BITS_ALONG * (b.first_row - 2.0) - REACH
        most_u = BITS_ALONG * (b.columns + 3.0)
        most_v = BITS_ALONG * (b.rows + 3.0)
        self.both[own] = 1
        for part in range(self.samples // FEW):
            # of the counts of eight samples at all shifts, the ones, twos, fours and eights
            ones = twos = fours = eights = 0
            for k in range(part * FEW, (part + 1) * FEW):
                bit_u = middle_u + self.offset[0, k]
                bit_v = middle_v + self.offset[1, k]
                near: cython.ulonglong = 0
                if 0.0 <= bit_u < most_u and 0.0 <= bit_v < most_v:
                    u: cython.int = int(bit_u)
                    v: cython.int = int(bit_v)
                    near = self.ridge_image[(v >> 2) * wide + (u >> 2)]
                    near >>= ((v & 3) << 3) + (u & 3)
                if not (ridges >> self.sample[k]) & 1:
                    near = ~near
                far = ones & near
                ones ^= near
                near = twos & far
                twos ^= far
                far = fours & near
                fours ^= near
                eights ^= far
            for r in range(SHIFTS):
                self.agreeing[own, r] += (
                    self.spread[(ones >> (8 * r)) & FIVE]
                    + ((self.spread[(twos >> (8 * r)) & FIVE]) << 1)
                    + ((self.spread[(fours >> (8 * r)) & FIVE]) << 2)
                    + ((self.spread[(eights >> (8 * r)) & FIVE]) << 3)
                )
        return 0

    @cython.locals(around=cython.int, best=cython.int, most=cython.ulonglong)
    def _best_shift(self, own, wide):
        """Return the correlation of a cell at the shift that suits it and those around it best.

        The five counts of a word are below 2,048 each.
        """
        around = best = most = 0
        for r in range(3):
            k = own + (r - 1) * wide
            around += self.both[k - 1] + self.both[k] + self.both[k + 1]
        if around < FEWEST_AROUND:
            return 0.0
        for r in range(SHIFTS):
            total: cython.ulonglong = self.wide[own - wide, r]
            total += self.wide[own, r]
            total += self.wide[own + wide, r]
            greater = ((((total | TOPS) - most) & TOPS) >> (LANE - 1)) * MOST_COUNT
            most = (total & greater) | (most & ~greater)
        for k in range(SHIFTS):
            count: cython.int = (most >> (LANE * k)) & MOST_COUNT
            best = max(best, count)
        self.cells += 1
        return 2.0 * best / (self.samples * around) - 1.0


def smaller_area(a, b):
    """Return the area of the smaller of two prints, in square pixels at 500 dpi."""
    return min(a.inside * (a.step * a.step), b.inside * (b.step * b.step))

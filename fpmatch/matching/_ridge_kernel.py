"""Kernel: how well the ridges of two prints fall on one another once their minutiae are laid so.

A cell of a print holds a picture of its ridges, 8 by 8 bits: bit ``8 * row + column`` is set on a
ridge. Cells are displaced as the paired minutiae around them are. Interpreted, the class runs as it
stands.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._print_kernel import Print
else:
    from fpmatch.matching._print_kernel import Print

COMPILED = cython.compiled

SIDE = cython.declare(cython.int, 8)  # bits along a cell
REACH = cython.declare(cython.int, 2)  # bits by which ridges may lie off, along either axis
SHIFTS = cython.declare(cython.int, 5)  # 2 * REACH + 1
FEWEST_AROUND = cython.declare(cython.int, 4)  # cells of 3 by 3 that must be in both prints
MOST_CELLS = cython.declare(cython.int, 16384)
# The samples of a cell, as rows and columns: every other row, of which every fourth bit, by turns.
SAMPLES = ((1, 1), (1, 5), (3, 3), (3, 7), (5, 1), (5, 5), (7, 3), (7, 7))
ALL = cython.declare(cython.ulonglong, 0xFFFFFFFFFFFFFFFF)
TOPS = cython.declare(cython.ulonglong, 0x8080808080808080)  # of the bytes of a word
FIVE = cython.declare(cython.ulonglong, 31)


@cython.final
@cython.cclass
class RidgeLens:
    """Compare the ridges of two prints, cell by cell, where they lie on one another.

    A cell of A is in both prints where its middle lies in B; it is compared with the cells that
    touch it, where at least four of these nine are in both. Eight of its bits are looked up in B,
    which has a valley wherever it has no cell; of all shifts, that under which the most of them
    agree counts.

    `parameters` are an `fpmatch.matching.ridges.RidgeParameters`; there is room for so many pairs
    of minutiae. After `compare`, `cells` is the number of cells that could be compared,
    `correlation` their mean correlation, -1 to 1.
    """

    def __init__(self, parameters, room) -> None:
        self.per_bend2 = 1.0 / (parameters.bend_sigma_px * parameters.bend_sigma_px)
        self.stillness = parameters.stillness
        self.correlation = 0.0
        self.cells = 0
        # five bits, one a byte
        spread = [sum(1 << (8 * k) for k in range(SHIFTS) if bits >> k & 1) for bits in range(32)]
        self.spread = np.array(spread, np.uint64)
        # the bits of a picture that stay in its rows where it is shifted by so many columns
        self.kept = np.array([0x0101010101010101 * (255 >> k) for k in range(SIDE)], np.uint64)
        self.sample_row = np.array([row for row, _ in SAMPLES], np.int32)
        self.sample_column = np.array([column for _, column in SAMPLES], np.int32)
        self.offset = np.zeros((2, len(SAMPLES)))
        self.picture = np.zeros(MOST_CELLS, np.uint64)
        self.agreeing = np.zeros((MOST_CELLS, SHIFTS), np.uint64)
        self.wide = np.zeros((MOST_CELLS, SHIFTS), np.uint64)
        self.both = np.zeros(MOST_CELLS, np.uint8)
        self.pair = np.zeros((4, room))
        self.pairs = 0
        self.c = 1.0
        self.s = 0.0
        self.x = 0.0
        self.y = 0.0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def compare(
        self,
        a: Print,
        b: Print,
        partner: cython.int[::1],
        c: cython.double,
        s: cython.double,
        x: cython.double,
        y: cython.double,
    ) -> cython.int:
        """Lay A on B by a transform, bent so that paired minutiae meet; return the cells compared.

        `partner` are the minutiae of B that those of A are paired with, or -1. Where a region has
        more than 16,384 cells, its border counted, none are compared.
        """
        row: cython.int
        column: cython.int
        k: cython.Py_ssize_t
        r: cython.Py_ssize_t
        own: cython.Py_ssize_t
        wide: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, a.columns) + 2
        self.correlation = 0.0
        self.cells = 0
        if not (a.has_ridges and b.has_ridges):
            return 0
        if (cython.cast(cython.Py_ssize_t, a.rows) + 2) * wide > MOST_CELLS:
            return 0
        if (b.rows + 4) * (cython.cast(cython.Py_ssize_t, b.columns) + 4) > MOST_CELLS:
            return 0
        self.c = c
        self.s = s
        self.x = x
        self.y = y
        self._gather(a, b, partner)
        for k in range((a.rows + 2) * wide):
            self.both[k] = 0
            for r in range(SHIFTS):
                self.agreeing[k, r] = 0
        for row in range(0, a.rows, 2):
            for column in range(0, a.columns, 2):
                self._count_block(a, b, row, column)
        for k in range(1, (a.rows + 2) * wide - 1):
            for r in range(SHIFTS):
                self.wide[k, r] = (
                    self.agreeing[k - 1, r] + self.agreeing[k, r] + self.agreeing[k + 1, r]
                )
        for row in range(a.rows):
            for column in range(a.columns):
                own = (row + 1) * wide + column + 1
                if self.both[own]:
                    self.correlation += self._settle(own, wide)
        if self.cells > 0:
            self.correlation = self.correlation / self.cells
        return self.cells

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _gather(self, a: Print, b: Print, partner: cython.int[::1]) -> cython.int:
        """Gather B's picture with two empty cells around it, the pairs, and the samples' places."""
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        k: cython.Py_ssize_t
        row: cython.int
        column: cython.int
        px: cython.double
        py: cython.double
        bit: cython.double = a.step / SIDE
        per_bit: cython.double = SIDE / b.step
        wide: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, b.columns) + 4
        for k in range((b.rows + 4) * wide):
            self.picture[k] = 0
        k = b.cell_at
        for row in range(b.rows):
            for column in range(b.columns):
                self.picture[(row + 2) * wide + column + 2] = b.ridges[k]
                k += 1
        self.pairs = 0
        for i in range(a.size):
            j = partner[i]
            if j >= 0 and self.pairs < self.pair.shape[1]:
                px = a.points[0, i]
                py = a.points[1, i]
                self.pair[0, self.pairs] = px
                self.pair[1, self.pairs] = py
                self.pair[2, self.pairs] = b.points[0, j] - (self.c * px - self.s * py + self.x)
                self.pair[3, self.pairs] = b.points[1, j] - (self.s * px + self.c * py + self.y)
                self.pairs += 1
        for k in range(self.sample_row.shape[0]):
            px = (cython.cast(cython.double, self.sample_column[k]) - 3.5) * bit
            py = -(cython.cast(cython.double, self.sample_row[k]) - 3.5) * bit
            self.offset[0, k] = (self.c * px - self.s * py) * per_bit
            self.offset[1, k] = -(self.s * px + self.c * py) * per_bit
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _count_block(self, a: Print, b: Print, top: cython.int, left: cython.int) -> cython.int:
        """Displace two by two cells as the paired minutiae are, near ones the most; count in each.

        A pair at distance d weighs ``1 / (1 + (d / bend_sigma_px)²)²``.
        """
        k: cython.Py_ssize_t
        row: cython.int
        column: cython.int
        last_row: cython.int = top + 2 if top + 2 < a.rows else a.rows
        last_column: cython.int = left + 2 if left + 2 < a.columns else a.columns
        any_cell: cython.bint = False
        px: cython.double = (a.first_column + left + 1.0) * a.step
        py: cython.double = -(a.first_row + top + 1.0) * a.step
        dx: cython.double
        dy: cython.double
        w: cython.double
        mass: cython.double = self.stillness
        drift_x: cython.double = 0.0
        drift_y: cython.double = 0.0
        half: cython.double = 0.5 * a.step - 0.5  # a pixel's middle has whole coordinates
        for row in range(top, last_row):
            for column in range(left, last_column):
                if a.cell[a.cell_at + row * a.columns + column]:
                    any_cell = True
        if not any_cell:
            return 0
        for k in range(self.pairs):
            dx = self.pair[0, k] - px
            dy = self.pair[1, k] - py
            w = 1.0 + (dx * dx + dy * dy) * self.per_bend2
            w = 1.0 / (w * w)
            mass += w
            drift_x += w * self.pair[2, k]
            drift_y += w * self.pair[3, k]
        if mass > 0.0:
            drift_x /= mass
            drift_y /= mass
        for row in range(top, last_row):
            for column in range(left, last_column):
                if a.cell[a.cell_at + row * a.columns + column]:
                    px = (a.first_column + column) * a.step + half
                    py = -((a.first_row + row) * a.step + half)
                    dx = self.c * px - self.s * py + self.x + drift_x
                    dy = self.s * px + self.c * py + self.y + drift_y
                    if b.contains(dx, dy):
                        self._count(a, b, row, column, dx, dy)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _count(
        self,
        a: Print,
        b: Print,
        row: cython.int,
        column: cython.int,
        x: cython.double,
        y: cython.double,
    ) -> cython.int:
        """Count the samples of a cell, its middle at a place of B, that agree at each shift."""
        k: cython.Py_ssize_t
        r: cython.int
        u: cython.int
        v: cython.int
        down: cython.int
        wide: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, b.columns) + 4
        own: cython.Py_ssize_t = (row + 1) * cython.cast(cython.Py_ssize_t, a.columns + 2)
        cell: cython.Py_ssize_t
        ridges: cython.ulonglong = cython.cast(
            cython.ulonglong, a.ridges[a.cell_at + row * a.columns + column]
        )
        near: cython.ulonglong
        far: cython.ulonglong
        kept: cython.ulonglong
        # of the counts of samples at all shifts, the ones, twos, fours and eights
        ones: cython.ulonglong = 0
        twos: cython.ulonglong = 0
        fours: cython.ulonglong = 0
        eights: cython.ulonglong = 0
        per_bit: cython.double = SIDE / b.step
        # the window of shifts begins so much before the sample, the picture two cells before B
        middle_u: cython.double = (x + 0.5) * per_bit - SIDE * (b.first_column - 2.0) - REACH
        middle_v: cython.double = (0.5 - y) * per_bit - SIDE * (b.first_row - 2.0) - REACH
        bit_u: cython.double
        bit_v: cython.double
        most_u: cython.double = SIDE * (b.columns + 3.0)
        most_v: cython.double = SIDE * (b.rows + 3.0)
        own += column + 1
        self.both[own] = 1
        for k in range(self.sample_row.shape[0]):
            bit_u = middle_u + self.offset[0, k]
            bit_v = middle_v + self.offset[1, k]
            near = 0
            if 0.0 <= bit_u < most_u and 0.0 <= bit_v < most_v:
                u = cython.cast(cython.int, bit_u)
                v = cython.cast(cython.int, bit_v)
                cell = (v >> 3) * wide + (u >> 3)
                down = SIDE * (v & 7)
                u &= 7
                near = cython.cast(cython.ulonglong, self.picture[cell]) >> down
                near |= (
                    (cython.cast(cython.ulonglong, self.picture[cell + wide]) << (63 - down)) << 1
                ) & ALL
                far = cython.cast(cython.ulonglong, self.picture[cell + 1]) >> down
                far |= (
                    (cython.cast(cython.ulonglong, self.picture[cell + wide + 1]) << (63 - down))
                    << 1
                ) & ALL
                kept = cython.cast(cython.ulonglong, self.kept[u])
                near = ((near >> u) & kept) | (((far << (SIDE - u)) & ALL) & (kept ^ ALL))
            down = SIDE * cython.cast(cython.int, self.sample_row[k])
            down += cython.cast(cython.int, self.sample_column[k])
            if not (ridges >> down) & 1:
                near ^= ALL
            far = ones & near
            ones ^= near
            near = twos & far
            twos ^= far
            far = fours & near
            fours ^= near
            eights ^= far
        for r in range(SHIFTS):
            self.agreeing[own, r] = (
                cython.cast(cython.ulonglong, self.spread[(ones >> (SIDE * r)) & FIVE])
                + (cython.cast(cython.ulonglong, self.spread[(twos >> (SIDE * r)) & FIVE]) << 1)
                + (cython.cast(cython.ulonglong, self.spread[(fours >> (SIDE * r)) & FIVE]) << 2)
                + (cython.cast(cython.ulonglong, self.spread[(eights >> (SIDE * r)) & FIVE]) << 3)
            )
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _settle(self, own: cython.Py_ssize_t, wide: cython.Py_ssize_t) -> cython.double:
        """Return the correlation of a cell at the shift that suits it and those around it best.

        Counts are the bytes of words, each below 128.
        """
        r: cython.Py_ssize_t
        k: cython.Py_ssize_t
        around: cython.int = 0
        best: cython.int = 0
        count: cython.int
        most: cython.ulonglong = 0
        total: cython.ulonglong
        greater: cython.ulonglong
        for r in range(3):
            k = own + (r - 1) * wide
            around += self.both[k - 1] + self.both[k] + self.both[k + 1]
        if around < FEWEST_AROUND:
            return 0.0
        for r in range(SHIFTS):
            total = cython.cast(cython.ulonglong, self.wide[own - wide, r])
            total += cython.cast(cython.ulonglong, self.wide[own, r])
            total += cython.cast(cython.ulonglong, self.wide[own + wide, r])
            greater = ((((total | TOPS) - most) & TOPS) >> 7) * 255
            most = (total & greater) | (most & (greater ^ ALL))
        for k in range(SHIFTS):
            count = cython.cast(cython.int, (most >> (SIDE * k)) & 255)
            best = count if count > best else best
        self.cells += 1
        return 2.0 * best / (self.sample_row.shape[0] * around) - 1.0

"""Kernel: how well the ridges of two prints fall on one another once their minutiae are laid so.

A cell of a print holds a picture of its ridges, 8 by 8 bits: bit ``8 * row + column`` is set on a
ridge. Cells are displaced as the paired minutiae around them are. Interpreted, the class runs as it
stands.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._print_kernel import Print
    from cython.cimports.libc.math import floor
else:
    from math import floor

    from fpmatch.matching._print_kernel import Print

COMPILED = cython.compiled

SIDE = cython.declare(cython.int, 8)  # bits along a cell
REACH = cython.declare(cython.int, 2)  # bits by which ridges may lie off, along either axis
SHIFTS = cython.declare(cython.int, 5)  # 2 * REACH + 1
LANE_BITS = cython.declare(cython.int, 12)  # of a count of samples: up to 9 * 16
LANE = cython.declare(cython.ulonglong, 4095)
SAMPLES = cython.declare(cython.int, 16)  # of a cell: every other bit of every other row
FEWEST_AROUND = cython.declare(cython.int, 4)  # cells of 3 by 3 that must be in both prints
MOST_CELLS = cython.declare(cython.int, 16384)


@cython.final
@cython.cclass
class RidgeLens:
    """Compare the ridges of two prints, cell by cell, where they lie on one another.

    A cell of A is in both prints where its middle lies in B; it is compared with the cells that
    touch it, where at least four of these nine are in both. Every other bit of every other row is
    looked up in B, which has a valley wherever it has no cell; of all shifts, that under which the
    most of them agree counts.

    `parameters` are an `fpmatch.matching.ridges.RidgeParameters`. After `compare`, `cells` is the
    number of cells that could be compared, `correlation` their mean correlation, -1 to 1.
    """

    def __init__(self, parameters) -> None:
        self.per_bend2 = 1.0 / (parameters.bend_sigma_px * parameters.bend_sigma_px)
        self.stillness = parameters.stillness
        self.correlation = 0.0
        self.cells = 0
        spread = [sum(1 << (12 * k) for k in range(5) if bits >> k & 1) for bits in range(32)]
        self.lanes = np.array(spread, np.uint64)
        self.agreeing = np.zeros((MOST_CELLS, SHIFTS), np.uint64)
        self.both = np.zeros(MOST_CELLS, np.uint8)
        self.drift = np.zeros((2, MOST_CELLS))
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

        `partner` are the minutiae of B that those of A are paired with, or -1. Of a region A of
        more than 16,384 cells, none are compared.
        """
        row: cython.int
        column: cython.int
        self.correlation = 0.0
        self.cells = 0
        if not (a.has_ridges and b.has_ridges):
            return 0
        if cython.cast(cython.Py_ssize_t, a.rows) * a.columns > MOST_CELLS:
            return 0
        self.c = c
        self.s = s
        self.x = x
        self.y = y
        self._follow_pairs(a, b, partner)
        for row in range(a.rows):
            for column in range(a.columns):
                self._count(a, b, row, column)
        for row in range(a.rows):
            for column in range(a.columns):
                self.correlation += self._settle(a, row, column)
        if self.cells > 0:
            self.correlation = self.correlation / self.cells
        return self.cells

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _follow_pairs(self, a: Print, b: Print, partner: cython.int[::1]) -> cython.int:
        """Displace every cell as the paired minutiae are, near ones the most.

        A pair at distance d weighs ``1 / (1 + (d / bend_sigma_px)²)²``.
        """
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        row: cython.int
        column: cython.int
        cell: cython.int
        px: cython.double
        py: cython.double
        dx: cython.double
        dy: cython.double
        w: cython.double
        mass: cython.double
        drift_x: cython.double
        drift_y: cython.double
        for row in range(a.rows):
            for column in range(a.columns):
                cell = row * a.columns + column
                self.both[cell] = 0
                if a.cell[a.cell_at + cell] == 0:
                    continue
                px = (a.first_column + column + 0.5) * a.step
                py = -(a.first_row + row + 0.5) * a.step
                mass = self.stillness
                drift_x = 0.0
                drift_y = 0.0
                for i in range(a.size):
                    j = partner[i]
                    if j >= 0:
                        dx = a.points[0, i] - px
                        dy = a.points[1, i] - py
                        w = 1.0 + (dx * dx + dy * dy) * self.per_bend2
                        w = 1.0 / (w * w)
                        mass += w
                        dx = self.c * a.points[0, i] - self.s * a.points[1, i] + self.x
                        dy = self.s * a.points[0, i] + self.c * a.points[1, i] + self.y
                        drift_x += w * (b.points[0, j] - dx)
                        drift_y += w * (b.points[1, j] - dy)
                if mass > 0.0:
                    drift_x /= mass
                    drift_y /= mass
                self.drift[0, cell] = drift_x
                self.drift[1, cell] = drift_y
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _count(self, a: Print, b: Print, row: cython.int, column: cython.int) -> cython.int:
        """Count the samples of a cell that agree with B, at each shift."""
        k: cython.int
        r: cython.int
        u: cython.int
        v: cython.int
        first: cython.int
        own: cython.int = row * a.columns + column
        cell: cython.Py_ssize_t
        word: cython.ulonglong
        bits: cython.ulonglong
        flip: cython.ulonglong
        ridges: cython.ulonglong
        px: cython.double
        py: cython.double
        qx: cython.double
        qy: cython.double
        bit_x: cython.double
        bit_y: cython.double
        bit: cython.double = a.step / SIDE
        per_bit: cython.double = SIDE / b.step
        half: cython.double = 0.5 * a.step - 0.5  # a pixel's middle has whole coordinates
        first_u: cython.int = SIDE * cython.cast(cython.int, b.first_column) + REACH
        first_v: cython.int = SIDE * cython.cast(cython.int, b.first_row) + REACH
        # beyond these bits of B, and where a place is no number, there is none to look up
        least_u: cython.double = SIDE * (b.first_column - 1.0)
        least_v: cython.double = SIDE * (b.first_row - 1.0)
        most_u: cython.double = least_u + SIDE * (b.columns + 2.0)
        most_v: cython.double = least_v + SIDE * (b.rows + 2.0)
        self.both[own] = 0
        if a.cell[a.cell_at + own] == 0:
            return 0
        px = (a.first_column + column) * a.step + half
        py = -((a.first_row + row) * a.step + half)
        qx = self.c * px - self.s * py + self.x + self.drift[0, own]
        qy = self.s * px + self.c * py + self.y + self.drift[1, own]
        if not b.holds(qx, qy):
            return 0
        self.both[own] = 1
        for k in range(SHIFTS):
            self.agreeing[own, k] = 0
        ridges = a.ridges[a.cell_at + own]
        for k in range(SAMPLES):
            # the sample's place beside the middle of the cell: odd bits of odd rows
            px = (2 * (k % 4) - 2.5) * bit
            py = -(2 * (k // 4) - 2.5) * bit
            bit_x = (qx + self.c * px - self.s * py + 0.5) * per_bit
            bit_y = (-(qy + self.s * px + self.c * py) + 0.5) * per_bit
            flip = 31 * (1 - ((ridges >> (SIDE * (2 * (k // 4) + 1) + 2 * (k % 4) + 1)) & 1))
            if not (least_u <= bit_x < most_u and least_v <= bit_y < most_v):
                for r in range(SHIFTS):
                    self.agreeing[own, r] += self.lanes[flip]
                continue
            u = cython.cast(cython.int, floor(bit_x)) - first_u
            v = cython.cast(cython.int, floor(bit_y)) - first_v
            first = u >> 3
            for r in range(SHIFTS):
                word = 0
                if 0 <= v + r < SIDE * b.rows:
                    cell = b.cell_at + ((v + r) >> 3) * b.columns + first
                    if 0 <= first < b.columns:
                        word = (b.ridges[cell] >> (SIDE * ((v + r) & 7))) & 255
                    if 0 <= first + 1 < b.columns:
                        bits = (b.ridges[cell + 1] >> (SIDE * ((v + r) & 7))) & 255
                        word |= bits << 8
                bits = ((word >> (u & 7)) & 31) ^ flip
                self.agreeing[own, r] += self.lanes[bits]
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _settle(self, a: Print, row: cython.int, column: cython.int) -> cython.double:
        """Return the correlation of a cell at the shift that suits it and those around it best."""
        r: cython.int
        k: cython.int
        other: cython.int
        best: cython.int = 0
        count: cython.int
        around: cython.int = 0
        own: cython.int = row * a.columns + column
        first: cython.int = row - 1 if row > 0 else 0
        last: cython.int = row + 1 if row + 1 < a.rows else row
        left: cython.int = column - 1 if column > 0 else 0
        right: cython.int = column + 1 if column + 1 < a.columns else column
        total: cython.ulonglong
        if not self.both[own]:
            return 0.0
        for r in range(first, last + 1):
            for k in range(left, right + 1):
                if self.both[r * a.columns + k]:
                    around += 1
        if around < FEWEST_AROUND:
            return 0.0
        for other in range(SHIFTS):
            total = 0
            for r in range(first, last + 1):
                for k in range(left, right + 1):
                    if self.both[r * a.columns + k]:
                        total += self.agreeing[r * a.columns + k, other]
            for k in range(SHIFTS):
                count = cython.cast(cython.int, (total >> (LANE_BITS * k)) & LANE)
                best = count if count > best else best
        self.cells += 1
        return 2.0 * best / (SAMPLES * around) - 1.0

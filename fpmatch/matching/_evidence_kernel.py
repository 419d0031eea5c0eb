"""Kernel: what two prints say to an alignment of theirs, and what that is worth.

A transform is (c, s, x, y) as `_align_kernel` has it; ``evidence`` has the entries named below.
Interpreted, the class and the functions run as they stand.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._align_kernel import LightTable
    from cython.cimports.fpmatch.matching._print_kernel import Print
    from cython.cimports.fpmatch.matching._ridge_kernel import RidgeLens
    from cython.cimports.libc.math import exp, log, log1p, sqrt
else:
    from math import exp, log, log1p, sqrt

    from fpmatch.matching._align_kernel import LightTable
    from fpmatch.matching._print_kernel import Print
    from fpmatch.matching._ridge_kernel import RidgeLens

COMPILED = cython.compiled

# Entries of the evidence:
PAIRS = cython.declare(cython.Py_ssize_t, 0)
LOCAL = cython.declare(cython.Py_ssize_t, 1)
UNPAIRED = cython.declare(cython.Py_ssize_t, 2)
COMMON = cython.declare(cython.Py_ssize_t, 3)
OVERLAP = cython.declare(cython.Py_ssize_t, 4)
RIDGES = cython.declare(cython.Py_ssize_t, 5)
CELLS = cython.declare(cython.Py_ssize_t, 6)
ENTRIES = cython.declare(cython.Py_ssize_t, 7)

# What a step of weight that the codes lack takes off the sum: about as much as it is worth.
LACKING = cython.declare(cython.double, 0.25)

FEATURES = cython.declare(cython.Py_ssize_t, 6)

# Rows of `standard`:
MIDDLE = cython.declare(cython.Py_ssize_t, 0)
SPREAD = cython.declare(cython.Py_ssize_t, 1)
WEIGHT = cython.declare(cython.Py_ssize_t, 2)
STRANGER = cython.declare(cython.Py_ssize_t, 3)


@cython.final
@cython.cclass
class Scales:
    """Weigh alignments of two prints.

    `score` is an `fpmatch.matching.score.ScoreParameters`, `ridges` a `RidgeParameters`, `weights`
    a `ScoreWeights`; there is room for so many minutiae of print B. `evidence` and `feature` are
    those of the alignment weighed last.
    """

    def __init__(self, score, ridges, weights, room) -> None:
        self.evidence = np.zeros(ENTRIES)
        self.best = np.zeros(ENTRIES)
        self.feature = np.zeros(FEATURES)
        self.standard = weights.standard
        self.bias = weights.bias
        self.glance, self.glance_growth, self.glance_most = weights.glance
        self.gate = weights.gate
        self.sure = weights.sure
        self.most = 0.0
        self.found = 0
        self.taken = np.empty(room, np.int32)
        self.lens = RidgeLens(ridges, room)
        self.margin = score.margin_px
        self.doubt_pairs = score.doubt_pairs
        self.doubt_cells = score.doubt_cells

    @cython.boundscheck(False)
    @cython.wraparound(False)
    def said(self) -> tuple:
        """Return the evidence and the features of the alignment weighed last, as lists."""
        return [self.evidence[k] for k in range(ENTRIES)], [
            self.feature[k] for k in range(FEATURES)
        ]

    @cython.ccall
    @cython.nogil
    @cython.exceptval(check=False)
    def lacking(self, weight: cython.int, smaller: cython.Py_ssize_t) -> cython.double:
        """Return how much the codes of two prints lack to be laid on one another.

        `weight` is what they say, `smaller` the minutiae of the smaller print. Where nothing is
        lacking the number is not positive.
        """
        enough: cython.double = self.glance + self.glance_growth * smaller
        return (enough if enough < self.glance_most else self.glance_most) - weight

    @cython.ccall
    @cython.nogil
    @cython.exceptval(check=False)
    def dismissed(self, lacking: cython.double) -> cython.double:
        """Return the sum for prints whose codes lack so much: below the gate."""
        return (self.gate if self.gate < 0.0 else 0.0) - LACKING * lacking

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def weigh(
        self,
        a: Print,
        b: Print,
        partner: cython.int[::1],
        bent: cython.double[:, ::1],
        c: cython.double,
        s: cython.double,
        x: cython.double,
        y: cython.double,
        likeness: cython.float[:, ::1],
    ) -> cython.double:
        """Return the weighted sum of the features of an alignment of A on B.

        ``partner[i]`` is the index in B of what minutia i of A is paired with, or -1; `bent` holds
        where it lies. The ridges are looked at only where the minutiae leave a doubt.
        """
        total: cython.double
        self._gather(a, b, partner, bent, 0, c, s, x, y, likeness)
        total = self._total()
        return self._look(a, b, partner, c, s, x, y) if total > self.gate else total

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def lay(
        self,
        a: Print,
        b: Print,
        table: LightTable,
        seeds: cython.int[:, ::1],
        count: cython.Py_ssize_t,
        likeness: cython.float[:, ::1],
    ) -> cython.double:
        """Lay A on B as the first `count` seeds say; return the weighted sum of the features.

        A few seeds are looked at first, their candidates laid rigidly. Where the minutiae do not
        speak for any of these so much that it passes the gate, the best of them stands: so it is
        with most prints of different fingers. Where they leave no doubt that the best of them is
        right, it alone is refined. Else the candidates of all seeds are refined, and the table
        keeps the one that the minutiae speak for the most. Then the ridges are looked at.

        Where nothing is paired by any, the table's `best_pairs` are 0, and so is the sum.
        """
        k: cython.Py_ssize_t
        best: cython.Py_ssize_t = 0
        passes: cython.bint
        first: cython.Py_ssize_t = table.first_seeds if table.first_seeds < count else count
        self.found = 0
        for k in range(table.propose(seeds, first)):
            table.sketch(k)
            best = k if self._keep_better(a, b, table, likeness) else best
        if self.found == 0:
            return 0.0
        passes = self.most > self.gate
        if passes:
            self._refine(a, b, table, seeds, first, count, best, likeness)
        for k in range(ENTRIES):
            self.evidence[k] = self.best[k]
        if not passes:
            return self._total()
        return self._look(
            a, b, table.best_partner, table.best_c, table.best_s, table.best_x, table.best_y
        )

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _refine(
        self,
        a: Print,
        b: Print,
        table: LightTable,
        seeds: cython.int[:, ::1],
        first: cython.Py_ssize_t,
        count: cython.Py_ssize_t,
        best: cython.Py_ssize_t,
        likeness: cython.float[:, ::1],
    ) -> cython.int:
        """Refine the best candidate of the first seeds, where it is sure, or those of all seeds."""
        k: cython.Py_ssize_t
        self.found = 0
        if self.most > self.sure:
            table.take(best)
            self._keep_better(a, b, table, likeness)
            return self.found
        for k in range(table.propose_more(seeds, first, count)):
            table.take(k)
            self._keep_better(a, b, table, likeness)
        return self.found

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _keep_better(
        self, a: Print, b: Print, table: LightTable, likeness: cython.float[:, ::1]
    ) -> cython.bint:
        """Let the table keep the alignment at hand where the minutiae speak for none more.

        Tell whether it does.
        """
        e: cython.Py_ssize_t
        total: cython.double
        better: cython.bint
        if table.pairs == 0:
            return False
        self._gather(
            a, b, table.partner, table.laid, 4, table.c, table.s, table.x, table.y, likeness
        )
        total = self._total()
        better = self.found == 0 or total > self.most
        if better:
            self.most = total
            table.keep()
            for e in range(ENTRIES):
                self.best[e] = self.evidence[e]
        self.found += 1
        return better

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _look(
        self,
        a: Print,
        b: Print,
        partner: cython.int[::1],
        c: cython.double,
        s: cython.double,
        x: cython.double,
        y: cython.double,
    ) -> cython.double:
        """Look at the ridges; return the weighted sum."""
        if self.lens.compare(a, b, partner, c, s, x, y) > 0:
            self.evidence[RIDGES] = self.lens.correlation
            self.evidence[CELLS] = self.lens.cells
        return self._total()

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def describe(self) -> cython.int:
        """Turn the evidence into features; see `fpmatch.matching.score`."""
        pairs: cython.double = self.evidence[PAIRS]
        local: cython.double = self.evidence[LOCAL]
        self.feature[0] = log(1.0 + local)
        self.feature[1] = log((1.0 + local) / (1.0 + pairs))
        self.feature[2] = sqrt(self.evidence[UNPAIRED] / (pairs + self.doubt_pairs))
        self.feature[3] = self.evidence[OVERLAP]
        if self.evidence[CELLS] > 0.0:
            self.feature[4] = self.evidence[RIDGES]
            self.feature[5] = log(self.evidence[CELLS] + self.doubt_cells)
        else:
            self.feature[4] = self.standard[STRANGER, 4]
            self.feature[5] = self.standard[STRANGER, 5]
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _total(self) -> cython.double:
        """Return the weighted sum of the features."""
        k: cython.Py_ssize_t
        total: cython.double = self.bias
        self.describe()
        for k in range(self.feature.shape[0]):
            total += (
                self.standard[WEIGHT, k]
                * (self.feature[k] - self.standard[MIDDLE, k])
                / self.standard[SPREAD, k]
            )
        return total

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def _gather(
        self,
        a: Print,
        b: Print,
        partner: cython.int[::1],
        bent: cython.double[:, ::1],
        row: cython.Py_ssize_t,
        c: cython.double,
        s: cython.double,
        x: cython.double,
        y: cython.double,
        likeness: cython.float[:, ::1],
    ) -> cython.int:
        """Gather what the minutiae say; nothing yet of the ridges.

        Those of A lie where rows `row` and ``row + 1`` of `bent` say.
        """
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        pairs: cython.double = 0.0
        common: cython.double = 0.0
        local: cython.double = 0.0
        unpaired: cython.double = 0.0
        unpaired_b: cython.double = 0.0
        px: cython.double
        py: cython.double
        qx: cython.double
        qy: cython.double
        area: cython.double
        smaller: cython.double
        scale: cython.double = c * c + s * s
        for j in range(b.size):
            self.taken[j] = 0
        for i in range(a.size):
            j = partner[i]
            if j >= 0:
                pairs += 1.0
                common += 1.0
                local += cython.cast(cython.double, likeness[i, j])
                self.taken[j] = 1
            elif b.holds(bent[row, i], bent[row + 1, i]):
                common += 1.0
                if b.surrounds(bent[row, i], bent[row + 1, i], self.margin):
                    unpaired += a.quality[i] * a.quality[i]
        for j in range(b.size):
            if self.taken[j]:
                common += 1.0
                continue
            qx = b.points[0, j] - x
            qy = b.points[1, j] - y
            px = (c * qx + s * qy) / scale
            py = (c * qy - s * qx) / scale
            if a.holds(px, py):
                common += 1.0
                if a.surrounds(px, py, self.margin):
                    unpaired_b += b.quality[j] * b.quality[j]
        self.evidence[PAIRS] = pairs
        self.evidence[LOCAL] = local
        self.evidence[UNPAIRED] = unpaired + unpaired_b
        self.evidence[COMMON] = common
        self.evidence[RIDGES] = 0.0
        self.evidence[CELLS] = 0.0
        self.evidence[OVERLAP] = 0.0
        smaller = a.inside * (a.step * a.step)
        area = b.inside * (b.step * b.step)
        smaller = area if area < smaller else smaller
        if smaller > 0.0:
            area = common_cells(a, b, c, s, x, y) * (a.step * a.step)
            self.evidence[OVERLAP] = area / smaller if area < smaller else 1.0
        return 0


@cython.cfunc
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def common_cells(
    a: Print,
    b: Print,
    c: cython.double,
    s: cython.double,
    x: cython.double,
    y: cython.double,
) -> cython.double:
    """Return how many cells of A fall into the region of B."""
    row: cython.int
    column: cython.int
    place: cython.Py_ssize_t = a.cell_at
    other: cython.Py_ssize_t
    bx: cython.double
    by: cython.double
    # of cells of B: a step of A to the right, and the middle of the first cell of a row
    right: cython.double = c * a.step * b.per_px
    down: cython.double = s * a.step * b.per_px
    first_x: cython.double
    first_y: cython.double
    columns: cython.double = b.columns
    rows: cython.double = b.rows
    cells: cython.int = 0
    for row in range(a.rows):
        first_x = x * b.per_px + right * (a.first_column + 0.5) - b.first_column
        first_x += down * (a.first_row + row + 0.5)
        first_y = right * (a.first_row + row + 0.5) - b.first_row
        first_y -= y * b.per_px + down * (a.first_column + 0.5)
        for column in range(a.columns):
            if a.cell[place] != 0:
                bx = first_x + column * right
                by = first_y - column * down
                if 0.0 <= bx < columns and 0.0 <= by < rows:
                    other = cython.cast(cython.Py_ssize_t, by) * b.columns
                    other += cython.cast(cython.Py_ssize_t, bx)
                    cells += b.cell[b.cell_at + other] != 0
            place += 1
    return cells


@cython.ccall
@cython.nogil
@cython.exceptval(check=False)
def as_similarity(total: cython.double) -> cython.double:
    """Return ``log(1 + e^total)``: positive, and for more than a few the sum itself."""
    if total > 0.0:
        return total + log1p(exp(-total))
    return log1p(exp(total))

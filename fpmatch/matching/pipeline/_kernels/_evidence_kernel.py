# mypy: ignore-errors
"""Kernel: the evidence in an alignment of two prints, its weighted sum, and the bounds of the FMR.

``evidence`` has the entries named below; `fpmatch.matching.pipeline.evidence` describes them. The
same computation in numpy is in `fpmatch.matching.reference.evidence`.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.pipeline._kernels._ridge_kernel import smaller_area
from cython.cimports.libc.math import exp, log, log10, sqrt

from fpmatch.matching.constants import *
from fpmatch.matching.pipeline._kernels._ridge_kernel import RidgeCorrelator

# Entries of the evidence, rows of `standard`, entries of `limits`, and the models:
PAIRS, LOCAL, UNPAIRED, COMMON, OVERLAP, RELAXED, PLACES, WEIGHTS = range(8)
FULLNESS, FEWEST, RIDGES, CELLS, AREA, ENTRIES = range(8, 14)
MIDDLE, SPREAD, WEIGHT, IMPOSTOR = range(4)
PREFILTER_BASE, PREFILTER_GROWTH, PREFILTER_LIMIT, RELAXATION, REFINE, CONFIDENT, BIAS = range(7)
WITH_RIDGES, MINUTIAE_ALONE, SMALL_WITH_RIDGES = range(3)

TERMS = cython.declare(cython.Py_ssize_t, 5)  # that the quantiles of impostors are linear in
FEATURES = cython.declare(cython.Py_ssize_t, 11)


@cython.final
@cython.cclass
class EvidenceScorer:
    """Score alignments of two prints, of which B has up to `capacity` minutiae.

    The model is chosen first, and with it the thresholds `relaxation`, `refine` and `confident`;
    `is_small` is whether it is that of small prints. `evidence`, `feature` and the terms of the
    amount, `term`, are those of the alignment weighed or estimated last; ``kept[h]`` is the
    evidence of row h of an aligner of so many `rows`.
    """

    def __init__(self, parameters, weights, capacity, rows) -> None:
        p = parameters
        self.kept = np.zeros((rows, ENTRIES))
        self.evidence = self.kept[0]
        self.feature = np.zeros(FEATURES)
        self.standard = np.stack([model.standard for model in weights.models])
        self.limits = np.stack([model.limits for model in weights.models])
        self.quantiles = np.stack([model.quantiles for model in weights.models])
        self.term = np.zeros(TERMS)
        self.paired_b = np.empty(capacity, np.int32)
        self.correlator = RidgeCorrelator(capacity)
        self.margin = p.margin_px
        self.doubt_pairs, self.doubt_cells = p.doubt_pairs, p.doubt_cells
        self.doubt_minutiae, self.usual_correlation = p.doubt_minutiae, p.usual_correlation
        self.beyond_from, self.beyond_share = p.beyond_from, p.beyond_share
        self.beyond_less, self.beyond_few = p.beyond_less, p.beyond_few

    def choose_model(self, a, b):
        """Choose the model by which two prints are scored; return its number."""
        self.model = MINUTIAE_ALONE
        if a.has_ridges and b.has_ridges:
            small: cython.bint = smaller_area(a, b) <= SMALL_AREA_PX2
            self.model = SMALL_WITH_RIDGES if small else WITH_RIDGES
        self.is_small = self.model == SMALL_WITH_RIDGES
        self.relaxation = self.limits[self.model, RELAXATION]
        self.refine = self.limits[self.model, REFINE]
        self.confident = self.limits[self.model, CONFIDENT]
        return self.model

    def threshold(self, smaller):
        """Return the prefilter's threshold, where the smaller print has so many minutiae."""
        enough = self.limits[self.model, PREFILTER_BASE]
        enough += self.limits[self.model, PREFILTER_GROWTH] * smaller
        return min(enough, self.limits[self.model, PREFILTER_LIMIT])

    def weigh(self, a, b, aligner, similarity, ridges, row):
        """Weigh the evidence in the current alignment, which is kept in a row; return the sum.

        The ridges are compared, warped by the mesh of pairs, if `ridges`.
        """
        self.evidence = self.kept[row]
        self._gather(a, b, aligner, similarity)
        c, s, x, y = aligner.c, aligner.s, aligner.x, aligner.y
        if ridges and self.correlator.compare(a, b, aligner.mesh, c, s, x, y) > 0:
            self.evidence[RIDGES] = self.correlator.correlation
            self.evidence[CELLS] = self.correlator.cells
        return self._total()

    def _gather(self, a, b, aligner, similarity):
        """Gather the evidence of the minutiae in the current alignment; none yet of the ridges."""
        pairs = local = common = common_b = 0.0
        unpaired = unpaired_b = squares = squares_b = 0.0
        partner, predicted = aligner.partner, aligner.predicted
        c, s, x, y = aligner.c, aligner.s, aligner.x, aligner.y
        scale = c * c + s * s
        margin_a = self.margin if a.has_flow else 0.0
        margin_b = self.margin if b.has_flow else 0.0
        for j in range(b.size):
            self.paired_b[j] = 0
        for i in range(a.size):
            squares += a.quality[i] * a.quality[i]
            j = partner[i]
            if j >= 0:
                pairs += 1.0
                common += 1.0
                local += float(similarity[i, j])
                self.paired_b[j] = 1
            elif b.contains(predicted[0, i], predicted[1, i]):
                common += 1.0
                if b.contains_with_margin(predicted[0, i], predicted[1, i], margin_b):
                    unpaired += a.quality[i] * a.quality[i]
        for j in range(b.size):
            squares_b += b.quality[j] * b.quality[j]
            if self.paired_b[j]:
                common_b += 1.0
                continue
            qx = b.points[0, j] - x
            qy = b.points[1, j] - y
            px = (c * qx + s * qy) / scale
            py = (c * qy - s * qx) / scale
            if a.contains(px, py):
                common_b += 1.0
                if a.contains_with_margin(px, py, margin_a):
                    unpaired_b += b.quality[j] * b.quality[j]
        unpaired *= quality_correction(squares, a.size)
        unpaired_b *= quality_correction(squares_b, b.size)
        smaller = smaller_area(a, b)
        area: cython.double = 0.0
        if smaller > 0.0:
            area = min(common_cells(a, b, c, s, x, y) * (a.step * a.step), smaller)
        self.evidence[PAIRS] = pairs
        self.evidence[LOCAL] = local
        self.evidence[UNPAIRED] = unpaired + unpaired_b
        self.evidence[COMMON] = common + common_b
        self.evidence[OVERLAP] = area / smaller if smaller > 0.0 else 0.0
        self.evidence[RELAXED] = aligner.relaxation.support_of(partner)
        self.evidence[PLACES] = aligner.mesh.places
        self.evidence[WEIGHTS] = aligner.mesh.weights
        self.evidence[FULLNESS] = aligner.mesh.full
        self.evidence[FEWEST] = min(a.size, b.size)
        self.evidence[RIDGES] = self.evidence[CELLS] = 0.0
        self.evidence[AREA] = area
        return 0

    @cython.locals(k=cython.Py_ssize_t)
    def _total(self):
        """Turn the evidence into features; return their weighted sum."""
        m: cython.Py_ssize_t = self.model
        pairs, cells = self.evidence[PAIRS], self.evidence[CELLS]
        per_pair = 1.0 / (1.0 + pairs)
        self.feature[0] = log(LEAST_RELAXED + self.evidence[RELAXED])
        self.feature[1] = self.evidence[PLACES] * per_pair
        self.feature[2] = self.evidence[WEIGHTS] * per_pair
        self.feature[3] = self.evidence[FULLNESS] * per_pair
        self.feature[4] = log(1.0 + self.evidence[LOCAL])
        self.feature[5] = sqrt(self.evidence[UNPAIRED] / (pairs + self.doubt_pairs))
        self.feature[6] = self.evidence[OVERLAP]
        self.feature[7] = pairs / (self.evidence[FEWEST] + self.doubt_minutiae)
        self.feature[8] = self.evidence[RIDGES]
        self.feature[9] = log(cells + self.doubt_cells)
        self.feature[10] = (self.evidence[RIDGES] - self.usual_correlation) * sqrt(cells)
        total = self.limits[m, BIAS]
        for k in range(FEATURES):
            if k >= 8 and not cells > 0.0:
                self.feature[k] = self.standard[m, IMPOSTOR, k]
            apart = self.standard[m, WEIGHT, k] * (self.feature[k] - self.standard[m, MIDDLE, k])
            total += apart / self.standard[m, SPREAD, k]
        return total

    def estimate(self, a, b, aligner, row):
        """Return the estimate of -ln(FMR) of a kept row, which was weighed before."""
        self.evidence = self.kept[row]
        self.total = self._total()
        return self._beyond_chance(a, b, aligner, row, self._condition())

    @cython.locals(k=cython.Py_ssize_t)
    def _condition(self):
        """Return -ln(FMR) of the weighted sum, given how much was compared, and its bound.

        The sums that 1 % and 0.1 % of the impostor comparisons reach depend on the minutiae and
        the area in the common region; beyond and between them the tail is exponential.
        """
        low = high = 0.0
        # the geometric mean of a print's minutiae in the common region and of the smaller's in all
        minutiae = sqrt(self.evidence[FEWEST] * self.evidence[COMMON] / 2.0)
        x = 1.0 / (saturated(minutiae, ENOUGH_MINUTIAE) + 1.0)
        y = log(max(saturated(self.evidence[AREA], ENOUGH_AREA), LEAST_AREA) / UNIT_AREA)
        self.term[0], self.term[1], self.term[2] = 1.0, x, x * x
        self.term[3], self.term[4] = y, x * y
        for k in range(TERMS):
            low += self.quantiles[self.model, 0, k] * self.term[k]
            high += self.quantiles[self.model, 1, k] * self.term[k]
        decades = 2.0 + (self.total - low) / max(high - low, LEAST_SPREAD)
        most = DECADES_PER_PAIR * max(self.evidence[PAIRS] - 1.0, 0.0)
        ridges = (self.evidence[RIDGES] - self.usual_correlation) / FULL_AGREEMENT
        ridges = min(max(ridges, 0.0), 1.0)
        return LOG_10 * min(decades, most + ridges * self.evidence[CELLS] / CELLS_PER_DECADE)

    def _beyond_chance(self, a_print, b_print, aligner, row, estimate):
        """Return an estimate of -ln(FMR), lowered where the pairs of a kept row are by chance.

        Above the decades that so many pairs, so near to their predictions, and the ridges justify,
        less some, and less more of them for few minutiae, an estimate is lowered by a share, as
        far as `beyond_from` decades. The pairs expected by chance are measured where the pairs lie:
        by how many minutiae of B lie around the prediction of a minutia of A in about its
        direction. So minutiae that are made to match many prints, in frequent places and
        directions, are expected to pair. Small prints, all of whose ridges are compared, are not
        lowered. Nothing counts beyond `beyond_from` where the minutiae of a print do not lie along
        its own ridges: no finger can have it.
        """
        if not estimate > LOG_10 * self.beyond_from or self.beyond_share == 0.0:
            return estimate
        if a_print.lies_off_ridges() or b_print.lies_off_ridges():
            return LOG_10 * self.beyond_from
        if self.is_small:
            return estimate
        around: cython.double = 0.0
        nearness: cython.double = 0.0
        place, b = aligner.kept_predicted, aligner.b
        for i in range(aligner.size_a):
            paired: cython.Py_ssize_t = aligner.kept_partner[row, i]
            for j in range(aligner.size_b):
                dx = b[0, j] - place[row, 0, i]
                dy = b[1, j] - place[row, 1, i]
                d2: cython.double = dx * dx + dy * dy
                if d2 < AROUND2:
                    cosine: cython.double = place[row, 2, i] * b[2, j] + place[row, 3, i] * b[3, j]
                    near: cython.double = min(d2 / BESIDE2, 1.0) * (1.0 - d2 / AROUND2)
                    around += near * max((cosine - LEAST_COSINE) / (1.0 - LEAST_COSINE), 0.0)
                    if j == paired:
                        nearness += log10(FAR_SHARE + DENSER_PLACE * exp(-0.5 * d2 / PLACE2))
                        nearness += log10(FAR_SHARE + DENSER_TURN * exp((cosine - 1.0) / TURN2))
        around = max(PER_AROUND * around, LEAST_BY_CHANCE)
        # half of the nearness counts, since the mesh fits the pairs
        bound = poisson_decades(self.evidence[PAIRS], around) + 0.5 * nearness
        ridges = self.evidence[RIDGES] - self.usual_correlation
        ridges = min(max((ridges - ALIGNED) / FULLY_ALIGNED, 0.0), 1.0)
        cells = self.evidence[CELLS]
        bound += ridges * (cells - 0.75 * max(cells - FULL_CELLS, 0.0)) / CELLS_PER_DECADE
        few = (ENOUGH_TO_HOLD - self.evidence[FEWEST]) / (ENOUGH_TO_HOLD - FEW_TO_HOLD)
        less = self.beyond_less + self.beyond_few * min(max(few, 0.0), 1.0)
        above = estimate - LOG_10 * (bound - less)
        lowered = estimate - self.beyond_share * max(above, 0.0)
        return max(lowered, LOG_10 * self.beyond_from)


@cython.locals(columns=cython.double, rows=cython.double)
def common_cells(a, b, c, s, x, y):
    """Return how many cells of A fall into the region of B."""
    # of cells of B: a step of A to the right, and the middle of the first cell of a row
    right = c * a.step * b.per_px
    down = s * a.step * b.per_px
    columns, rows = b.columns, b.rows
    cells: cython.int = 0
    for row in range(a.rows):
        first_x = x * b.per_px + right * (a.first_column + 0.5) - b.first_column
        first_x += down * (a.first_row + row + 0.5)
        first_y = right * (a.first_row + row + 0.5) - b.first_row
        first_y -= y * b.per_px + down * (a.first_column + 0.5)
        for column in range(a.columns):
            if a.cell[row, column] != 0:
                bx = first_x + column * right
                by = first_y - column * down
                if 0.0 <= bx < columns and 0.0 <= by < rows:
                    at_row: cython.Py_ssize_t = int(by)
                    at_column: cython.Py_ssize_t = int(bx)
                    cells += b.cell[at_row, at_column] != 0
    return cells


def poisson_decades(count, mean):
    """Return Chernoff's bound of -log10 of the probability of `count` or more Poisson events."""
    return (count * log(count / mean) - count + mean) / LOG_10 if count > mean else 0.0


def quality_correction(squares, minutiae):
    """Return the factor that raises poor qualities, given their sum of squares, to usual ones."""
    least = LEAST_MEAN_SQUARE * minutiae
    return least / squares if 0.0 < squares < least else 1.0


def saturated(amount, enough):
    """Return about the amount where it is much less than `enough`, else about `enough`."""
    share = amount / enough
    share = share * share
    return amount / sqrt(sqrt(1.0 + share * share))

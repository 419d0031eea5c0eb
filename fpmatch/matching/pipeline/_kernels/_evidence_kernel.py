# mypy: ignore-errors
"""Kernel: the evidence in an alignment of two prints, and its weighted sum.

A transform is (c, s, x, y) as `_alignment_kernel` has it; ``evidence`` has the entries named below.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.pipeline._kernels import _amount_kernel as amount
from cython.cimports.libc.math import exp, log, log10, sqrt

from fpmatch.matching.constants import comparison
from fpmatch.matching.pipeline._kernels._ridge_kernel import RidgeCorrelator
from fpmatch.matching.prints._kernels._template_view_kernel import FLOW_OF_CODE

# Entries of the evidence, rows of `standard`, entries of `limits`, and the models:
PAIRS, LOCAL, UNPAIRED, COMMON, OVERLAP, RELAXED, PLACES, WEIGHTS = range(8)
FULLNESS, FEWEST, RIDGES, CELLS, AREA, CHANCE, ENTRIES = range(8, 15)
MIDDLE, SPREAD, WEIGHT, IMPOSTOR = range(4)
PREFILTER_BASE, PREFILTER_GROWTH, PREFILTER_LIMIT, RELAXATION, REFINE, CONFIDENT, BIAS = range(7)
WITH_RIDGES, MINUTIAE_ALONE, SMALL_WITH_RIDGES = range(3)

REJECTED = cython.declare(cython.double, comparison.REJECTED)
SHORTFALL = cython.declare(cython.double, comparison.SHORTFALL)
TERMS = cython.declare(cython.Py_ssize_t, 5)  # that the quantiles of impostors are linear in
SMALL_AREA_PX2 = cython.declare(cython.double, comparison.SMALL_AREA_PX2)
PAIR_AREA = cython.declare(cython.double, comparison.PAIR_AREA)
LEAST_SPREAD = cython.declare(cython.double, comparison.LEAST_SPREAD)
LOG_10 = cython.declare(cython.double, comparison.LOG_10)
AROUND2 = cython.declare(cython.double, comparison.AROUND2)
BESIDE2 = cython.declare(cython.double, comparison.BESIDE2)
LEAST_COSINE = cython.declare(cython.double, comparison.LEAST_COSINE)
PER_AROUND = cython.declare(cython.double, comparison.PER_AROUND)
PLACE2 = cython.declare(cython.double, comparison.PLACE2)
TURN2 = cython.declare(cython.double, comparison.TURN2)
DENSER_PLACE = cython.declare(cython.double, comparison.DENSER_PLACE)
DENSER_TURN = cython.declare(cython.double, comparison.DENSER_TURN)
FAR_SHARE = cython.declare(cython.double, comparison.FAR_SHARE)
FEW_TO_HOLD = cython.declare(cython.double, comparison.FEW_TO_HOLD)
ENOUGH_TO_HOLD = cython.declare(cython.double, comparison.ENOUGH_TO_HOLD)
FEATURES = cython.declare(cython.Py_ssize_t, 11)
LEAST_RELAXED = cython.declare(cython.double, comparison.LEAST_RELAXED)


@cython.final
@cython.cclass
class EvidenceScorer:
    """Score alignments of two prints, of which B has up to `capacity` minutiae.

    The model depends on which prints have ridge images. `evidence` and `feature` are those of the
    alignment scored last.
    """

    def __init__(self, score, weights, capacity) -> None:
        self.evidence = np.zeros(ENTRIES)
        self.feature = np.zeros(FEATURES)
        self.standard = np.stack([model.standard for model in weights.models])
        self.limits = np.stack([model.limits for model in weights.models])
        self.quantiles = np.stack([model.quantiles for model in weights.models])
        self.term = np.zeros(TERMS)
        self.model = 0
        self.total = 0.0
        self.paired_b = np.empty(capacity, np.int32)
        self.correlator = RidgeCorrelator(capacity)
        self.margin = score.margin_px
        self.hull_margin = score.hull_margin_px
        self.doubt_pairs = score.doubt_pairs
        self.doubt_cells = score.doubt_cells
        self.doubt_minutiae = score.doubt_minutiae
        self.usual_correlation = score.usual_correlation
        self.beyond_from = score.beyond_from
        self.beyond_less = score.beyond_less
        self.beyond_few = score.beyond_few
        self.beyond_share = score.beyond_share
        self.flow = FLOW_OF_CODE

    def last_evidence(self) -> tuple:
        """Return the evidence and the features of the alignment scored last, as lists."""
        evidence = [self.evidence[k] for k in range(ENTRIES)]
        return evidence, [self.feature[k] for k in range(FEATURES)]

    def choose_model(self, ridges_a, ridges_b, area):
        """Choose the model by which prints have ridge images, and by the area; return its number.

        `area` is that of the smaller print, in square pixels at 500 dpi.
        """
        if ridges_a and ridges_b:
            self.model = SMALL_WITH_RIDGES if area <= SMALL_AREA_PX2 else WITH_RIDGES
        else:
            self.model = MINUTIAE_ALONE
        return self.model

    def prefilter_shortfall(self, weight, smaller):
        """Return by how much the prefilter's score `weight` falls short; positive if rejected.

        `smaller` is the number of minutiae of the smaller print. The model is chosen before.
        """
        enough = self.limits[self.model, PREFILTER_BASE]
        enough += self.limits[self.model, PREFILTER_GROWTH] * smaller
        return min(enough, self.limits[self.model, PREFILTER_LIMIT]) - weight

    def prefilter_rejected(self, shortfall):
        """Return what stands for -ln(FMR) of prints that the prefilter rejects."""
        return REJECTED - SHORTFALL * shortfall

    def score_alignment(self, a, b, aligner, similarity):
        """Score the current alignment of the aligner; return -ln(FMR) as `condition` estimates it.

        The ridges are compared only if the sum of the minutiae passes the refine threshold.
        """
        self.choose_model(a.has_ridges, b.has_ridges, amount.smaller_area(a, b))
        total = self.weigh(a, b, aligner, similarity, False)
        if total > self.limits[self.model, REFINE]:
            total = self._compare_ridges(a, b, aligner)
        aligner.keep(0)
        return self.beyond_chance(a, b, aligner, 0, self.condition(total))

    def refine_threshold(self):
        """Return the sum beyond which a hypothesis is grown to the end."""
        return self.limits[self.model, REFINE]

    def confident_threshold(self):
        """Return the sum beyond which no other hypothesis is tried."""
        return self.limits[self.model, CONFIDENT]

    def relaxation_threshold(self):
        """Return the strength of the local matches below which they are weak."""
        return self.limits[self.model, RELAXATION]

    def is_small(self):
        """Return whether all pairs of minutiae are tried in a search by ridges."""
        return self.model == SMALL_WITH_RIDGES

    def weigh(self, a, b, aligner, similarity, ridges):
        """Weigh the evidence in the current alignment, `ridges` compared if true; return the sum.

        The model is chosen before.
        """
        self._gather(a, b, aligner, similarity)
        if ridges and a.has_ridges and b.has_ridges:
            return self._compare_ridges(a, b, aligner)
        return self._total()

    def score(self, evidence, row):
        """Return -ln(FMR) of evidence that was weighed before, as `condition` estimates it."""
        for k in range(ENTRIES):
            self.evidence[k] = evidence[row, k]
        return self.condition(self._total())

    def _compare_ridges(self, a, b, aligner):
        """Correlate the ridges, warped by the mesh of pairs; return the weighted sum."""
        c, s, x, y = aligner.c, aligner.s, aligner.x, aligner.y
        if self.correlator.compare(a, b, aligner.mesh, c, s, x, y) > 0:
            self.evidence[RIDGES] = self.correlator.correlation
            self.evidence[CELLS] = self.correlator.cells
        return self._total()

    def describe(self):
        """Turn the evidence into features; see `fpmatch.matching.pipeline.evidence`."""
        pairs = self.evidence[PAIRS]
        per_pair = 1.0 / (1.0 + pairs)
        self.feature[0] = log(LEAST_RELAXED + self.evidence[RELAXED])
        self.feature[1] = self.evidence[PLACES] * per_pair
        self.feature[2] = self.evidence[WEIGHTS] * per_pair
        self.feature[3] = self.evidence[FULLNESS] * per_pair
        self.feature[4] = log(1.0 + self.evidence[LOCAL])
        self.feature[5] = sqrt(self.evidence[UNPAIRED] / (pairs + self.doubt_pairs))
        self.feature[6] = self.evidence[OVERLAP]
        self.feature[7] = pairs / (self.evidence[FEWEST] + self.doubt_minutiae)
        if self.evidence[CELLS] > 0.0:
            self.feature[8] = self.evidence[RIDGES]
            self.feature[9] = log(self.evidence[CELLS] + self.doubt_cells)
            self.feature[10] = self.evidence[RIDGES] - self.usual_correlation
            self.feature[10] *= sqrt(self.evidence[CELLS])
        else:
            for k in range(8, 11):
                self.feature[k] = self.standard[self.model, IMPOSTOR, k]
        return 0

    @cython.locals(k=cython.Py_ssize_t)
    def condition(self, total):
        """Return -ln(FMR) of a weighted sum, given how much was compared.

        The sums that 1 % and 0.1 % of the impostor comparisons reach depend on the minutiae and
        the area in the common region; beyond and between them the tail is exponential, up to
        `most_decades`. The model is chosen, and the evidence gathered, before. `total` keeps the
        sum.
        """
        low = high = 0.0
        self.total = total
        # the geometric mean of a print's minutiae in the common region and of the smaller's in all
        minutiae = sqrt(self.evidence[FEWEST] * self.evidence[COMMON] / 2.0)
        amount.describe_amount(minutiae, self.evidence[AREA], self.term)
        for k in range(TERMS):
            low += self.quantiles[self.model, 0, k] * self.term[k]
            high += self.quantiles[self.model, 1, k] * self.term[k]
        high = max(high - low, LEAST_SPREAD)
        ridges = self.evidence[RIDGES] - self.usual_correlation
        cells = self.evidence[CELLS]
        limit = amount.most_decades(self.evidence[PAIRS], self.evidence[CHANCE], ridges, cells)
        return LOG_10 * min(2.0 + (total - low) / high, limit)

    def beyond_chance(self, a_print, b_print, aligner, row, estimate):
        """Return an estimate of -ln(FMR), lowered where the pairs of a kept row are by chance.

        An estimate above the decades that `decades_beyond_chance` finds, less some, and less more
        of them for few minutiae, is lowered by a share of what it is above, as far as `beyond_from`
        decades; lower ones stay. The pairs expected by chance are measured where the pairs lie: by
        how many minutiae of B lie around the prediction of a minutia of A in about its direction.
        So minutiae that are made to match many prints, in frequent places and directions, are
        expected to pair. Small prints, all of whose ridges are compared, are not lowered. Nothing
        counts beyond `beyond_from` where the minutiae of a print do not lie along its own ridges:
        no finger can have it.
        """
        if not estimate > LOG_10 * self.beyond_from or self.beyond_share == 0.0:
            return estimate
        if a_print.lies_off_ridges(self.flow) or b_print.lies_off_ridges(self.flow):
            return LOG_10 * self.beyond_from
        if self.is_small():
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
        ridges = self.evidence[RIDGES] - self.usual_correlation
        bound = amount.decades_beyond_chance(
            self.evidence[PAIRS], PER_AROUND * around, nearness, ridges, self.evidence[CELLS]
        )
        few = (ENOUGH_TO_HOLD - self.evidence[FEWEST]) / (ENOUGH_TO_HOLD - FEW_TO_HOLD)
        less = self.beyond_less + self.beyond_few * min(max(few, 0.0), 1.0)
        above = estimate - LOG_10 * (bound - less)
        lowered = estimate - self.beyond_share * max(above, 0.0)
        return max(lowered, LOG_10 * self.beyond_from)

    @cython.locals(k=cython.Py_ssize_t)
    def _total(self):
        """Return the weighted sum of the features."""
        m: cython.Py_ssize_t = self.model
        total = self.limits[m, BIAS]
        self.describe()
        for k in range(FEATURES):
            apart = self.standard[m, WEIGHT, k] * (self.feature[k] - self.standard[m, MIDDLE, k])
            total += apart / self.standard[m, SPREAD, k]
        return total

    def _gather(self, a, b, aligner, similarity):
        """Gather the evidence of the minutiae in the current alignment; none yet of the ridges."""
        pairs = local = common = common_b = 0.0
        unpaired = unpaired_b = squares = squares_b = 0.0
        partner, predicted = aligner.partner, aligner.predicted
        c, s, x, y = aligner.c, aligner.s, aligner.x, aligner.y
        scale = c * c + s * s
        margin_a = self.margin if a.has_flow else self.hull_margin
        margin_b = self.margin if b.has_flow else self.hull_margin
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
        self.evidence[PAIRS] = pairs
        self.evidence[LOCAL] = local
        unpaired *= amount.quality_correction(squares, a.size)
        unpaired_b *= amount.quality_correction(squares_b, b.size)
        self.evidence[UNPAIRED] = unpaired + unpaired_b
        self.evidence[COMMON] = common + common_b
        self.evidence[RELAXED] = aligner.relaxation.support_of(partner)
        self.evidence[PLACES] = aligner.mesh.places
        self.evidence[WEIGHTS] = aligner.mesh.weights
        self.evidence[FULLNESS] = aligner.mesh.full
        self.evidence[FEWEST] = min(a.size, b.size)
        self.evidence[RIDGES] = self.evidence[CELLS] = self.evidence[OVERLAP] = 0.0
        self.evidence[AREA] = self.evidence[CHANCE] = 0.0
        smaller = amount.smaller_area(a, b)
        if smaller > 0.0:
            area = min(amount.common_cells(a, b, c, s, x, y) * (a.step * a.step), smaller)
            self.evidence[OVERLAP] = area / smaller
            self.evidence[AREA] = area
            if area > 0.0:
                self.evidence[CHANCE] = common * common_b * PAIR_AREA / area
        return 0

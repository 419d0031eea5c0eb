# mypy: ignore-errors
"""Kernel: the default matcher's way from two prepared prints to the estimate of -ln(FMR).

`Pipeline.match` is that way, step by step as `fpmatch.matching.reference` takes it. Before it come
the prefilter's bit descriptors; `fit_pairs` fits the transform of the pairs in pixels after it.
"""

import cython
import numpy as np
from cython.cimports.fpmatch.matching.pipeline._kernels._amount_kernel import smaller_area
from cython.cimports.fpmatch.matching.pipeline._kernels._local_kernel import normalize_by_size
from cython.cimports.libc.math import atan2, cos, sin, sqrt

UNPAIRED = cython.declare(cython.double, float("-inf"))  # the sum where nothing is paired


@cython.final
@cython.cclass
class Pipeline:
    """Match a probe with one reference after the other, each of up to `capacity` minutiae.

    The prints are taken in the order of their content, so that exchanging them changes nothing: a
    reference is print A or print B. `neighbours`, the index of the probe's, is set before it is
    matched. `parameters` are a `pipeline.parameters.LocalParameters`.

    Hypotheses are rows that the aligner keeps: ``total[h]`` is the sum of hypothesis h and
    ``evidence[h]`` what it is made of. `best` is the row of the result, -1 where nothing is paired.
    """

    def __init__(self, capacity, prefilter, aligner, scorer, search, parameters) -> None:
        self.prefilter, self.scorer, self.search = prefilter, scorer, search
        self.aligner = aligner
        self.similarity = np.empty((capacity, capacity), np.float32)
        self.total = np.empty(aligner.rows)
        self.evidence = np.empty((aligner.rows, len(scorer.evidence)))
        self.best = -1
        self.probe = self.neighbours = None
        self.min_cosine = parameters.min_cosine
        self.fewest_neighbours = parameters.fewest_neighbours

    def load(self, probe):
        """Take a probe in place of the last one."""
        self.probe = probe
        p = probe
        self.prefilter.load(p.xy, p.direction_bin, p.neighbour_bits, p.orientation_bins, p.has_flow)
        return 0

    def shortfall(self, reference, reference_first):
        """Return by how much the prefilter's score falls short of its threshold."""
        self.scorer.choose_model(
            self.probe.has_ridges, reference.has_ridges, smaller_area(self.probe, reference)
        )
        return self.scorer.prefilter_shortfall(
            self.prefilter.score(
                reference.first,
                reference.first + reference.size,
                reference.xy,
                reference.direction_bin,
                reference.neighbour_bits,
                reference.orientation_bins,
                reference.has_flow,
                reference_first,
            ),
            min(self.probe.size, reference.size),
        )

    def match_with(self, reference, reference_first):
        """Match the probe with a reference; the result is that of `match`."""
        if reference_first:
            return self.match(reference, self.probe, True)
        return self.match(self.probe, reference, False)

    def match(self, a, b, reference_first):
        """Match print A with print B, one of which is the probe; return the estimate of -ln(FMR).

        Both are triangulated, and their rings are described. The seven steps are

        1. local match: how similar the neighbourhoods of any two minutiae are;
        2. relax: local matches that agree support each other;
        3. pair and grow: from each hypothesis of the relaxed matches pairs grow over their mesh on
           the unit circle (eq. 3 and 4), coarsely, and are weighed;
        4. ridges: the hypotheses that may be right grow to the end, and their ridges count;
        5. search by ridges: where doubt remains, the ridges propose further hypotheses;
        6. evidence and score: that of the hypothesis of the greatest sum, the first of equals;
        7. transform: that of its pairs (eq. 1), which `best` names.

        The result is 0, and `best` -1, where no hypothesis pairs anything.
        """
        self.aligner.load(a.points, a.size, b.points, b.size)
        self.scorer.choose_model(a.has_ridges, b.has_ridges, smaller_area(a, b))
        self._match_locally(a, b, reference_first)
        self.aligner.relax(self.similarity)
        best = self._pair_and_grow(a, b)
        doubtful: cython.bint = a.has_ridges and b.has_ridges and not self._is_confident(best)
        best = self._grow_to_the_end(a, b, best)
        if doubtful and not self._is_confident(best):
            best = self._search_by_ridges(a, b, best)
        self.best = best
        if best < 0:
            return 0.0
        estimate = self.scorer.score(self.evidence, best)
        return self.scorer.beyond_chance(a, b, self.aligner, best, estimate)

    def _match_locally(self, a, b, reference_first):
        """Fill the local similarities of A and B by the index of the probe's neighbours."""
        least = self.min_cosine
        if reference_first:
            self.neighbours.to_prints(a.count, a.frame, a.size, least, self.similarity, True)
        else:
            self.neighbours.to_prints(b.count, b.frame, b.size, least, self.similarity, False)
        return normalize_by_size(
            self.similarity, a.count, a.size, b.count, b.size, self.fewest_neighbours
        )

    def _pair_and_grow(self, a, b):
        """Grow the hypotheses coarsely, in turn; return the best, -1 if none pairs anything.

        A confident one is the last; where the local matches are weak, so is the first with a pair.
        """
        best: cython.Py_ssize_t = -1
        weak: cython.bint = self.aligner.relaxation.strength < self.scorer.relaxation_threshold()
        for h in range(self.aligner.hypotheses):
            self.total[h] = UNPAIRED
        for h in range(self.aligner.hypotheses):
            if self.aligner.start_hypothesis(h) > 0:
                self._weigh(a, b, h, False)
                best = self._better(best, h)
                if weak or self.total[h] > self.scorer.confident_threshold():
                    break
        return best

    def _grow_to_the_end(self, a, b, best):
        """Grow to the end what passes the refine threshold, and compare ridges; return the best.

        As with most impostor prints, none may pass: then the best of coarse growth stays. If it is
        confident, it grows alone.
        """
        grown: cython.Py_ssize_t = -1
        refine = self.scorer.refine_threshold()
        alone: cython.bint = self._is_confident(best)
        if best < 0 or not self.total[best] > refine:
            return best
        for h in range(self.aligner.hypotheses):
            if self.total[h] > refine and (h == best or not alone) and self.aligner.refine(h) > 0:
                self._weigh(a, b, h, True)
                grown = self._better(grown, h)
        return grown

    def _search_by_ridges(self, a, b, best):
        """Grow from the pairs of minutiae under which the ridges agree; return the best of all."""
        if self.scorer.is_small():
            proposed = self.search.search(a, b, self.scorer.correlator)
        else:
            proposed = self.search.search_candidates(
                a, b, self.aligner.relaxation, self.scorer.correlator
            )
        for k in range(proposed):
            h: cython.Py_ssize_t = self.aligner.hypotheses + k
            if self.aligner.start_from(self.search.first[k], self.search.second[k], h) > 0:
                self._weigh(a, b, h, True)
                best = self._better(best, h)
        return best

    def _weigh(self, a, b, h, ridges):
        """Weigh the evidence of hypothesis h, the current one of the aligner."""
        self.total[h] = self.scorer.weigh(a, b, self.aligner, self.similarity, ridges)
        for e in range(self.evidence.shape[1]):
            self.evidence[h, e] = self.scorer.evidence[e]
        return 0

    def _better(self, best, h):
        """Return which of two hypotheses has the greater sum, `best` of equals; it may be -1."""
        return h if best < 0 or self.total[h] > self.total[best] else best

    def _is_confident(self, h):
        """Return whether no other hypothesis than h need be tried; h may be -1."""
        return h >= 0 and self.total[h] > self.scorer.confident_threshold()


@cython.locals(i=cython.Py_ssize_t)
def fit_pairs(
    a,
    b,
    to_500dpi_a,
    to_500dpi_b,
    index_a,
    index_b,
    partner,
    weight,
    turn,
    fewest,
    most_stretch,
    swapped,
    pairs,
    fitted,
):
    """Fit the transform of the pairs in pixels, y pointing down; return the number of pairs.

    `a` and `b` are the minutiae (4, N) of two prints at 500 dpi, to which their pixels are scaled
    by `to_500dpi_a` and `to_500dpi_b`; `index_a` and `index_b` are their numbers in the templates.
    ``partner[i]`` is the minutia of B that minutia i of A is paired with, or -1. The least-squares
    transform of the weighted pairs is taken if there are `fewest` at least and its scale is that of
    the resolutions up to a factor of `most_stretch`; else that scale and the rotation `turn` are.
    ``fitted[:4]`` become scale, rotation and shift, ``fitted[4]`` the root of the mean square
    distance; from B to A where `swapped`, and `pairs` are sorted accordingly.
    """
    n: cython.int = 0
    mass = pmx = pmy = qmx = qmy = 0.0
    cosine = sine = spread = total = 0.0
    scale = to_500dpi_a / to_500dpi_b
    for i in range(a.shape[1]):
        j: cython.Py_ssize_t = partner[i]
        if j < 0:
            continue
        w = weight[i]
        mass += w
        pmx += w * (a[0, i] / to_500dpi_a)
        pmy -= w * (a[1, i] / to_500dpi_a)
        qmx += w * (b[0, j] / to_500dpi_b)
        qmy -= w * (b[1, j] / to_500dpi_b)
        if swapped:
            k = n
            while k > 0 and pairs[k - 1, 0] > index_b[j]:
                pairs[k, 0], pairs[k, 1] = pairs[k - 1, 0], pairs[k - 1, 1]
                k -= 1
            pairs[k, 0], pairs[k, 1] = index_b[j], index_a[i]
        else:
            pairs[n, 0], pairs[n, 1] = index_a[i], index_b[j]
        n += 1
    pmx /= mass
    pmy /= mass
    qmx /= mass
    qmy /= mass
    if n >= fewest:
        for i in range(a.shape[1]):
            j = partner[i]
            if j < 0:
                continue
            w = weight[i]
            px = a[0, i] / to_500dpi_a - pmx
            py = -a[1, i] / to_500dpi_a - pmy
            qx = b[0, j] / to_500dpi_b - qmx
            qy = -b[1, j] / to_500dpi_b - qmy
            cosine += w * (px * qx + py * qy)
            sine += w * (px * qy - py * qx)
            spread += w * (px * px + py * py)
        free = sqrt(cosine * cosine + sine * sine)
        free = free / spread if spread > 0.0 and free > 0.0 else 1.0
        if 1.0 / most_stretch <= free / scale <= most_stretch:
            turn = atan2(sine, cosine)
            scale = free
    cosine = scale * cos(turn)
    sine = scale * sin(turn)
    px = qmx - cosine * pmx + sine * pmy
    py = qmy - sine * pmx - cosine * pmy
    fitted[0], fitted[1], fitted[2], fitted[3] = scale, turn, px, py
    for i in range(a.shape[1]):
        j = partner[i]
        if j < 0:
            continue
        qx = cosine * a[0, i] / to_500dpi_a + sine * a[1, i] / to_500dpi_a
        qy = sine * a[0, i] / to_500dpi_a - cosine * a[1, i] / to_500dpi_a
        qx = qx + px - b[0, j] / to_500dpi_b
        qy = qy + py + b[1, j] / to_500dpi_b
        total += qx * qx + qy * qy
    fitted[4] = sqrt(total / n)
    if swapped:
        fitted[0] = 1.0 / scale
        fitted[1] = -turn
        cosine /= scale * scale
        sine /= scale * scale
        fitted[2] = -cosine * px - sine * py
        fitted[3] = sine * px - cosine * py
        fitted[4] /= scale
    return n

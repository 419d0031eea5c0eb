# mypy: ignore-errors
"""Kernel: the default matcher's way from two prepared prints to the estimate of -ln(FMR).

`Pipeline.match` is that way, step by step as `fpmatch.matching.reference` takes it. Before it come
the prefilter's bit descriptors; after it, `reference.transform_of` fits the transform in pixels.
"""

import cython
import numpy as np

from fpmatch.matching.constants import *
from fpmatch.matching.pipeline._kernels._alignment_kernel import Aligner
from fpmatch.matching.pipeline._kernels._evidence_kernel import EvidenceScorer
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import RidgeSearch
from fpmatch.matching.prints._kernels._prefilter_kernel import Prefilter

UNPAIRED = cython.declare(cython.double, float("-inf"))  # the sum where nothing is paired


@cython.final
@cython.cclass
class Pipeline:
    """Match a probe with one reference after the other, each of up to `capacity` minutiae.

    The prints are taken in the order of their content, so that exchanging them changes nothing: a
    reference is print A or print B. `neighbours`, the index of the probe's, is set before it is
    matched. For one thread. `parameters` are `matching.parameters.MatchParameters`, `weights` the
    `ScoreWeights`.

    Hypotheses are rows that the aligner keeps: ``total[h]`` is the sum of hypothesis h. `best` is
    the row of the result, -1 where nothing is paired.
    `kept` are the rows as arrays: partners and weights of A's minutiae, transforms, and evidence.
    """

    def __init__(self, capacity, parameters, weights) -> None:
        self.capacity, self.parameters, self.weights = capacity, parameters, weights
        self.prefilter = Prefilter(parameters)
        self.aligner = Aligner(capacity, capacity, parameters)
        self.scorer = EvidenceScorer(parameters, weights, capacity, self.aligner.rows)
        self.search = RidgeSearch(parameters)
        self.similarity = np.empty((capacity, capacity), np.float32)
        self.total = np.empty(self.aligner.rows)
        self.kept = [np.asarray(self.aligner.kept_partner), np.asarray(self.aligner.kept_weight)]
        self.kept += [np.asarray(self.aligner.kept_transform), np.asarray(self.scorer.kept)]

    def load(self, probe):
        """Take a probe, unless it was the last one."""
        if probe is not self.probe:
            self.probe = probe
            self.prefilter.load(
                probe.xy,
                probe.direction_bin,
                probe.neighbour_bits,
                probe.orientation_bins,
                probe.has_flow,
            )
        return 0

    def rejected(self, reference, reference_first):
        """Return the estimate of -ln(FMR) of a pair that the prefilter rejects; else 0."""
        self.scorer.choose_model(self.probe, reference)
        smaller: cython.Py_ssize_t = min(self.probe.size, reference.size)
        shortfall = self.scorer.threshold(smaller) - self.prefilter.score(
            0,
            reference.size,
            reference.xy,
            reference.direction_bin,
            reference.neighbour_bits,
            reference.orientation_bins,
            reference.has_flow,
            reference_first,
        )
        return REJECTED - SHORTFALL * shortfall if shortfall > 0.0 else 0.0

    def match(self, reference, reference_first):
        """Match the probe with a reference; return the estimate of -ln(FMR).

        Both are triangulated, and their rings are described. The six steps are

        1. local match: how similar the neighbourhoods of any two minutiae are;
        2. relax: local matches that agree support each other;
        3. pair and grow: from each hypothesis of the relaxed matches pairs grow over their mesh on
           the unit circle (eq. 3 and 4), coarsely, and are weighed;
        4. ridges: the hypotheses that may be right grow to the end, and their ridges count;
        5. search by ridges: where doubt remains, the ridges propose further hypotheses;
        6. evidence and score: that of the hypothesis of the greatest sum, the first of equals.

        The result is 0, and `best` -1, where no hypothesis pairs anything.
        """
        self.neighbours.to_prints(
            reference.count, reference.frame, reference.size, self.similarity, reference_first
        )
        if reference_first:
            return self._match(reference, self.probe)
        return self._match(self.probe, reference)

    def _match(self, a, b):
        """Match print A with print B, whose local similarities are given."""
        self.aligner.load(a.points, a.size, b.points, b.size)
        self.scorer.choose_model(a, b)
        self.aligner.relaxation.load(a.points, a.size, b.points, b.size, self.similarity)
        best = self._pair_and_grow(a, b)
        doubtful: cython.bint = a.has_ridges and b.has_ridges and not self._is_confident(best)
        best = self._grow_to_the_end(a, b, best)
        if doubtful and not self._is_confident(best):
            best = self._search_by_ridges(a, b, best)
        self.best = best
        return self.scorer.estimate(a, b, self.aligner, best) if best >= 0 else 0.0

    def _pair_and_grow(self, a, b):
        """Grow the hypotheses coarsely, in turn; return the best, -1 if none pairs anything.

        A confident one is the last; where the local matches are weak, so is the first with a pair.
        """
        best: cython.Py_ssize_t = -1
        weak: cython.bint = self.aligner.relaxation.strength < self.scorer.relaxation
        for h in range(self.aligner.rows):
            self.total[h] = UNPAIRED
        for h in range(self.aligner.hypotheses):
            if self.aligner.start_hypothesis(h) > 0:
                best = self._weigh(a, b, h, False, best)
                if weak or self._is_confident(h):
                    break
        return best

    def _grow_to_the_end(self, a, b, best):
        """Grow to the end what passes the refine threshold, and compare ridges; return the best.

        As with most impostor prints, none may pass: then the best of coarse growth stays. If it is
        confident, it grows alone.
        """
        grown: cython.Py_ssize_t = -1
        alone: cython.bint = self._is_confident(best)
        if best < 0 or not self.total[best] > self.scorer.refine:
            return best
        for h in range(self.aligner.hypotheses):
            passes: cython.bint = self.total[h] > self.scorer.refine and (h == best or not alone)
            if passes and self.aligner.refine(h) > 0:
                grown = self._weigh(a, b, h, True, grown)
        return grown

    def _search_by_ridges(self, a, b, best):
        """Grow from the pairs of minutiae under which the ridges agree; return the best of all."""
        proposed = self.search.search(
            a, b, self.aligner.relaxation, self.scorer.is_small, self.scorer.correlator
        )
        for k in range(proposed):
            h: cython.Py_ssize_t = self.aligner.hypotheses + k
            if self.aligner.start_from(self.search.first[k], self.search.second[k], h) > 0:
                best = self._weigh(a, b, h, True, best)
        return best

    def _weigh(self, a, b, h, ridges, best):
        """Weigh hypothesis h, the current one of the aligner; return the better of it and `best`.

        That is `best` of equals; it may be -1.
        """
        self.total[h] = self.scorer.weigh(a, b, self.aligner, self.similarity, ridges, h)
        return h if best < 0 or self.total[h] > self.total[best] else best

    def _is_confident(self, h):
        """Return whether no other hypothesis than h need be tried; h may be -1."""
        return h >= 0 and self.total[h] > self.scorer.confident

"""Kernel: compare one print with many, one after the other, and keep nothing but the similarity.

It takes the steps of `fpmatch.matching.matchers.unit_circle` through the same kernels, and so comes
to the same numbers. Interpreted, it runs as it stands.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._align_kernel import Aligner
    from cython.cimports.fpmatch.matching._bit_descriptor_kernel import Prefilter
    from cython.cimports.fpmatch.matching._evidence_kernel import EvidenceScorer, as_similarity
    from cython.cimports.fpmatch.matching._local_kernel import NeighbourIndex, normalize_by_size
    from cython.cimports.fpmatch.matching._template_view_kernel import PackedView, TemplateView
else:
    from fpmatch.matching._align_kernel import Aligner
    from fpmatch.matching._bit_descriptor_kernel import Prefilter
    from fpmatch.matching._evidence_kernel import EvidenceScorer, as_similarity
    from fpmatch.matching._local_kernel import NeighbourIndex, normalize_by_size
    from fpmatch.matching._template_view_kernel import PackedView, TemplateView

COMPILED = cython.compiled


@cython.final
@cython.cclass
class OneToMany:
    """One print, and the workspace in which it is compared with one after the other of many.

    `prefilter` has the print in its tables; `neighbours` are the print's own; `before` and `after` the
    aligners in which a reference is print A or print B; `reference` has room for any of them.
    """

    prefilter: Prefilter
    probe: TemplateView
    reference: TemplateView
    neighbours: NeighbourIndex
    before: Aligner
    after: Aligner
    local_similarity: cython.float[:, ::1]
    scorer: EvidenceScorer
    min_cosine: cython.double
    fewest_neighbours: cython.int
    fewest_minutiae: cython.int

    def __init__(
        self,
        prefilter,
        probe,
        reference,
        neighbours,
        before,
        after,
        room,
        local,
        scorer,
        fewest_minutiae,
    ) -> None:
        self.prefilter = prefilter
        self.probe = probe
        self.reference = reference
        self.neighbours = neighbours
        self.before = before
        self.after = after
        self.local_similarity = np.empty((room, room), np.float32)
        self.scorer = scorer
        self.min_cosine = local.min_cosine
        self.fewest_neighbours = local.fewest_neighbours
        self.fewest_minutiae = fewest_minutiae

    @cython.ccall
    def compare(
        self,
        packed: PackedView,
        first: cython.Py_ssize_t,
        order: cython.const[cython.schar][::1],
        similarity: cython.double[::1],
    ) -> cython.int:
        """Fill the similarities to the prints from number `first` on.

        Where ``order[k]`` is negative the reference comes before the probe, where it is positive
        after; where it is 0, the similarity is not touched.
        """
        k: cython.Py_ssize_t
        shortfall: cython.double
        self.reference.cell = packed.cell
        self.reference.ridges = packed.ridges
        with cython.nogil:
            for k in range(order.shape[0]):
                if order[k] == 0:
                    continue
                shortfall = self._prefilter_shortfall(packed, first + k, order[k] < 0)
                if shortfall > 0.0:
                    similarity[k] = as_similarity(self.scorer.prefilter_rejected(shortfall))
                else:
                    packed.unpack(first + k, self.reference)
                    similarity[k] = self._similarity(order[k] < 0)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _prefilter_shortfall(
        self, packed: PackedView, k: cython.Py_ssize_t, reference_first: cython.bint
    ) -> cython.double:
        """Return by how much the probe and print k fall short of the prefilter's threshold."""
        first: cython.Py_ssize_t = packed.minutiae_start[k]
        last: cython.Py_ssize_t = packed.minutiae_start[k + 1]
        smaller: cython.Py_ssize_t = last - first
        weight: cython.int
        area: cython.double
        own_area: cython.double
        if self.probe.size < smaller:
            smaller = self.probe.size
        if smaller < self.fewest_minutiae:
            return 0.0
        weight = self.prefilter.score(
            first,
            last,
            packed.xy,
            packed.direction_bin,
            packed.neighbour_bits,
            packed.orientation_bins,
            packed.has_flow[k],
            reference_first,
        )
        area = packed.inside[k] * (packed.step[k] * packed.step[k])
        own_area = self.probe.inside * (self.probe.step * self.probe.step)
        area = own_area if own_area < area else area
        self.scorer.choose_model(self.probe.has_ridges, packed.has_ridges[k], area)
        return self.scorer.prefilter_shortfall(weight, smaller)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _similarity(self, reference_first: cython.bint) -> cython.double:
        """Return the similarity of the probe and the reference at hand."""
        n: cython.Py_ssize_t = self.reference.size
        if n < self.fewest_minutiae or self.probe.size < self.fewest_minutiae:
            return 0.0
        if reference_first:
            self.neighbours.to_prints_before(
                self.reference.count,
                self.reference.frame,
                n,
                self.min_cosine,
                self.local_similarity,
            )
            normalize_by_size(
                self.local_similarity,
                self.reference.count,
                n,
                self.probe.count,
                self.probe.size,
                self.fewest_neighbours,
            )
            self.before.put_a(self.reference.points, n)
            return self._aligned(self.reference, self.probe, self.before)
        self.neighbours.to_prints_after(
            self.reference.count, self.reference.frame, n, self.min_cosine, self.local_similarity
        )
        normalize_by_size(
            self.local_similarity,
            self.probe.count,
            self.probe.size,
            self.reference.count,
            n,
            self.fewest_neighbours,
        )
        self.after.put_b(self.reference.points, n)
        return self._aligned(self.probe, self.reference, self.after)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _aligned(self, a: TemplateView, b: TemplateView, aligner: Aligner) -> cython.double:
        """Return the similarity of two prints that an aligner holds."""
        total: cython.double = self.scorer.align(a, b, aligner, self.local_similarity)
        return as_similarity(total) if aligner.best_pairs > 0 else 0.0

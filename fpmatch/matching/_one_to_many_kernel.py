"""Kernel: one print compared with many, one after the other, and nothing but the similarity kept.

It takes the steps of `fpmatch.matching.matchers.unit_circle` through the same kernels, and so comes
to the same numbers. Interpreted, it runs as it stands.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._align_kernel import LightTable
    from cython.cimports.fpmatch.matching._code_kernel import Sieve
    from cython.cimports.fpmatch.matching._evidence_kernel import Scales, as_similarity
    from cython.cimports.fpmatch.matching._local_kernel import (
        NeighbourIndex,
        divide_by_size,
        most_alike,
    )
    from cython.cimports.fpmatch.matching._print_kernel import PackedPrints, Print
else:
    from fpmatch.matching._align_kernel import LightTable
    from fpmatch.matching._code_kernel import Sieve
    from fpmatch.matching._evidence_kernel import Scales, as_similarity
    from fpmatch.matching._local_kernel import NeighbourIndex, divide_by_size, most_alike
    from fpmatch.matching._print_kernel import PackedPrints, Print

COMPILED = cython.compiled


@cython.final
@cython.cclass
class OneToMany:
    """One print, and the room in which it is compared with one after the other of many.

    `sieve` has the print in its tables; `neighbours` are the print's own; `before` and `after` the
    tables on which a reference lies under it or over it; `reference` has room for any of them.
    """

    sieve: Sieve
    probe: Print
    reference: Print
    neighbours: NeighbourIndex
    before: LightTable
    after: LightTable
    likeness: cython.float[:, ::1]
    seeds: cython.int[:, ::1]
    value: cython.float[::1]
    scales: Scales
    min_cosine: cython.double
    fewest_neighbours: cython.int
    fewest_minutiae: cython.int

    def __init__(
        self,
        sieve,
        probe,
        reference,
        neighbours,
        before,
        after,
        room,
        local,
        scales,
        fewest_minutiae,
    ) -> None:
        self.sieve = sieve
        self.probe = probe
        self.reference = reference
        self.neighbours = neighbours
        self.before = before
        self.after = after
        self.likeness = np.empty((room, room), np.float32)
        self.seeds = np.empty((local.seeds, 2), np.int32)
        self.value = np.empty(local.seeds, np.float32)
        self.scales = scales
        self.min_cosine = local.min_cosine
        self.fewest_neighbours = local.fewest_neighbours
        self.fewest_minutiae = fewest_minutiae

    @cython.ccall
    @cython.boundscheck(False)
    @cython.wraparound(False)
    def compare(
        self,
        packed: PackedPrints,
        first: cython.Py_ssize_t,
        order: cython.const[cython.schar][::1],
        similarity: cython.double[::1],
    ) -> cython.int:
        """Fill the similarities to the prints from number `first` on.

        Where ``order[k]`` is negative the reference comes before the probe, where it is positive
        after; where it is 0, the similarity is not touched.
        """
        k: cython.Py_ssize_t
        lacking: cython.double
        self.reference.cell = packed.cell
        self.reference.ridges = packed.ridges
        with cython.nogil:
            for k in range(order.shape[0]):
                if order[k] == 0:
                    continue
                lacking = self._lacking(packed, first + k, order[k] < 0)
                if lacking > 0.0:
                    similarity[k] = as_similarity(self.scales.dismissed(lacking))
                else:
                    packed.unpack(first + k, self.reference)
                    similarity[k] = self._similarity(order[k] < 0)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _lacking(
        self, packed: PackedPrints, k: cython.Py_ssize_t, reference_first: cython.bint
    ) -> cython.double:
        """Return how much the codes of the probe and print k lack to be laid on one another."""
        first: cython.Py_ssize_t = packed.minutiae_start[k]
        last: cython.Py_ssize_t = packed.minutiae_start[k + 1]
        smaller: cython.Py_ssize_t = last - first
        weight: cython.int
        if self.probe.size < smaller:
            smaller = self.probe.size
        if smaller < self.fewest_minutiae:
            return 0.0
        weight = self.sieve.weigh(
            first,
            last,
            packed.xy,
            packed.turn,
            packed.around,
            packed.along,
            packed.has_flow[k],
            reference_first,
        )
        return self.scales.lacking(weight, smaller)

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _similarity(self, reference_first: cython.bint) -> cython.double:
        """Return the similarity of the probe and the reference at hand."""
        n: cython.Py_ssize_t = self.reference.size
        count: cython.int
        if n < self.fewest_minutiae or self.probe.size < self.fewest_minutiae:
            return 0.0
        if reference_first:
            self.neighbours.to_prints_before(
                self.reference.count, self.reference.frame, n, self.min_cosine, self.likeness
            )
            divide_by_size(
                self.likeness,
                self.reference.count,
                n,
                self.probe.count,
                self.probe.size,
                self.fewest_neighbours,
            )
            count = most_alike(self.likeness, n, self.probe.size, self.seeds, self.value)
            self.before.put_a(self.reference.points, n)
            return self._laid(self.reference, self.probe, self.before, count)
        self.neighbours.to_prints_after(
            self.reference.count, self.reference.frame, n, self.min_cosine, self.likeness
        )
        divide_by_size(
            self.likeness,
            self.probe.count,
            self.probe.size,
            self.reference.count,
            n,
            self.fewest_neighbours,
        )
        count = most_alike(self.likeness, self.probe.size, n, self.seeds, self.value)
        self.after.put_b(self.reference.points, n)
        return self._laid(self.probe, self.reference, self.after, count)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _laid(self, a: Print, b: Print, table: LightTable, seeds: cython.int) -> cython.double:
        """Return the similarity of two prints, A laid on B from so many seeds."""
        total: cython.double = self.scales.lay(a, b, table, self.seeds, seeds, self.likeness)
        return as_similarity(total) if table.best_pairs > 0 else 0.0

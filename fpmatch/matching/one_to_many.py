"""Compare one print with many: the similarities alone."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching._one_to_many_kernel import OneToMany
from fpmatch.matching._template_view_kernel import TemplateView
from fpmatch.matching.align import make_aligner
from fpmatch.matching.bit_descriptors import prefilter_of
from fpmatch.matching.local import LocalParameters, index_neighbours
from fpmatch.matching.score import evidence_scorer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.packed_templates import PackedTemplates
    from fpmatch.matching.prepare import PreparedTemplate

MIN_MINUTIAE: Final = 1
"""The fewest minutiae that a print is compared by."""

MINUTIAE_ORDERED_BY: Final = 3
"""So many minutiae are looked at to tell which of two prints comes first."""

NEITHER_FIRST: Final = 0
REFERENCE_FIRST: Final = -1
PROBE_FIRST: Final = 1


def canonical_order(
    probe: PreparedTemplate, references: PackedTemplates, first: int, last: int
) -> NDArray[np.int8]:
    """Tell which of the probe and each reference comes first, as their keys do.

    Parameters
    ----------
    probe : PreparedTemplate
        One print.
    references : PackedTemplates
        Many.
    first, last : int
        Those from `first` up to, not including, `last`.

    Returns
    -------
    ndarray of int8, shape (last - first,)
        `REFERENCE_FIRST`, `PROBE_FIRST`, or `NEITHER_FIRST` where that takes the whole keys, which
        begin with the first minutiae's x. Between prints of too few minutiae it has no meaning.
    """
    start = references.minutiae_start[first:last]
    size = np.diff(references.minutiae_start[first : last + 1])
    found = np.full(len(start), PROBE_FIRST, np.int8)
    undecided = np.flatnonzero(size >= MIN_MINUTIAE)
    if len(probe) < MIN_MINUTIAE:
        return found
    found[undecided] = NEITHER_FIRST
    for k in range(min(MINUTIAE_ORDERED_BY, len(probe))):
        undecided = undecided[size[undecided] > k]
        theirs = _as_ordered(references.xy[start[undecided] + k, 0].astype(np.float64))
        ours = _as_ordered(probe.points[0, k : k + 1])
        found[undecided] = np.where(theirs < ours, REFERENCE_FIRST, PROBE_FIRST)
        undecided = undecided[theirs == ours]
        found[undecided] = NEITHER_FIRST
    return found


def similarities(
    probe: PreparedTemplate, references: PackedTemplates, first: int, last: int
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Compare one print with many.

    Parameters
    ----------
    probe : PreparedTemplate
        One print.
    references : PackedTemplates
        Many, prepared with the same parameters.
    first, last : int
        Those from `first` up to, not including, `last` are compared.

    Returns
    -------
    similarity : ndarray of float64, shape (last - first,)
        The similarity to each.
    left : ndarray of intp, shape (K,)
        Numbers of those, of a content too like the probe's, that were left out; 0 stands for them.
    """
    similarity = np.zeros(max(last - first, 0))
    if not len(similarity):
        return similarity, np.empty(0, np.intp)
    order = canonical_order(probe, references, first, last)
    _workspace(probe, references).compare(references.packed, first, order, similarity)
    return similarity, first + np.flatnonzero(order == NEITHER_FIRST)


def _as_ordered(x: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Return numbers that are in the order in which the bytes of `x` are."""
    given = np.ascontiguousarray(x, np.float64).view(np.uint64)
    return given.byteswap() if sys.byteorder == "little" else given


def _workspace(probe: PreparedTemplate, references: PackedTemplates) -> OneToMany:
    """Return what compares the probe with any of the references."""
    local = LocalParameters()
    ours, theirs = len(probe), references.most_minutiae
    before = make_aligner(theirs, ours)
    before.put_b(probe.points, ours)
    after = make_aligner(ours, theirs)
    after.put_a(probe.points, ours)
    return OneToMany(
        prefilter_of(probe.bit_descriptors),
        probe.for_kernels(),
        _room(references),
        index_neighbours(probe.neighbourhoods, local, comes_first=False),
        before,
        after,
        max(ours, theirs),
        local,
        evidence_scorer(max(ours, theirs)),
        MIN_MINUTIAE,
    )


def _room(references: PackedTemplates) -> TemplateView:
    """Return a print that any of the references can be unpacked into."""
    n = references.most_minutiae
    return TemplateView(
        np.empty((4, n)),
        np.empty(n),
        np.empty(n, np.int32),
        np.empty((n, 6, references.neighbour.shape[1]), np.float32),
    )

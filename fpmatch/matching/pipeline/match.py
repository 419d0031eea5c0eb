"""The pipeline: one print is matched with one, or with many, in a workspace that is used again."""

from __future__ import annotations

import sys
import threading
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import RidgeSearch
from fpmatch.matching.pipeline.alignment import (
    LocalParameters,
    RidgeSearchParameters,
    identity_alignment,
    index_neighbours,
    kept_alignment,
    local_similarity,
    make_aligner,
)
from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
from fpmatch.matching.prints.bit_descriptors import prefilter, score_descriptors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.pipeline._kernels._evidence_kernel import EvidenceScorer
    from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex
    from fpmatch.matching.pipeline.alignment import Alignment
    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.prints.bit_descriptors import BitDescriptors
    from fpmatch.matching.prints.prepare import PreparedTemplate
    from fpmatch.matching.prints.prepared_prints import PreparedPrints

MIN_MINUTIAE: Final = 1  # the fewest that a print is compared by
PREPARED_KEPT: Final = 64  # views and indices of prints, used last: a fifth of a megabyte each
LEAST_CAPACITY: Final = 64  # minutiae that a thread's workspace has room for at least
ORDERED_BY: Final = 3  # minutiae that decide which print comes first, before the whole keys do
NEITHER_FIRST: Final = 0
REFERENCE_FIRST: Final = -1
PROBE_FIRST: Final = 1


class Workspace:
    """Compare a probe with one reference after the other, of `capacity` minutiae; for one thread.

    The scorer has the weights in the package unless one is given. `reference_first` is whether a
    reference comes first, in the order of the content.
    """

    def __init__(self, capacity: int, scorer: EvidenceScorer | None = None) -> None:
        self.capacity = capacity
        self.weights = score.load_weights()
        self.scorer = score.evidence_scorer(capacity) if scorer is None else scorer
        before, after = (make_aligner(capacity, capacity) for _ in range(2))
        search = RidgeSearch(RidgeSearchParameters())
        self._kernel: Any = Pipeline(
            capacity, prefilter(), before, after, self.scorer, search, LocalParameters()
        )
        self._probe: PreparedTemplate | None = None
        self._packed_view: TemplateView | None = None

    def load(self, probe: PreparedTemplate) -> None:
        """Take a probe, unless it was the last one."""
        if probe is not self._probe:
            self._kernel.load(view_of(probe))
            self._probe = probe

    def rejected(self, reference: PreparedTemplate, *, reference_first: bool) -> float | None:
        """Return the estimate of -ln(FMR) of a pair that the prefilter rejects; else None."""
        shortfall: float = self._kernel.shortfall(view_of(reference), reference_first)
        return self.scorer.prefilter_rejected(shortfall) if shortfall > 0.0 else None

    def common_bits(self, descriptors: BitDescriptors) -> int:
        """Return how much bit descriptors have in common with those of the probe."""
        return score_descriptors(self._kernel.prefilter, descriptors)

    def match(
        self, reference: PreparedTemplate, *, reference_first: bool
    ) -> tuple[Alignment, Evidence] | None:
        """Match the probe with a reference; None if nothing is paired."""
        self._kernel.neighbours = _index_of(self._probe, threading.get_ident())
        total = self._kernel.match_with(view_of(reference), reference_first)
        if self._kernel.best < 0:
            return None
        aligner = self._kernel.before if reference_first else self._kernel.after
        alignment = kept_alignment(aligner, self._kernel.best)
        return alignment, score.evidence_of(self.scorer, total)

    def similarities(
        self, references: PreparedPrints, first: int, order: NDArray[np.int8]
    ) -> NDArray[np.float64]:
        """Return the similarities of the probe to references from number `first` on.

        `order` is what `canonical_order` returned of them; where neither comes first, it is 0.
        """
        similarity = np.zeros(len(order))
        self._kernel.neighbours = _index_of(self._probe, threading.get_ident())
        if self._packed_view is None:
            n, size = self.capacity, references.neighbour.shape[1]
            arrays = np.empty((4, n)), np.empty(n), np.empty(n, np.int32)
            self._packed_view = TemplateView(*arrays, np.empty((n, 6, size), np.float32))
        self._kernel.match_packed(references.view, self._packed_view, first, order, similarity)
        return similarity


_THREAD: Final = threading.local()


def workspace_for(minutiae: int) -> Workspace:
    """Return the thread's own workspace, with capacity for prints of so many minutiae."""
    workspace: Workspace | None = getattr(_THREAD, "workspace", None)
    if (
        workspace is None
        or workspace.capacity < minutiae
        or workspace.weights is not score.load_weights()
    ):
        capacity = max(LEAST_CAPACITY, 1 << (minutiae - 1).bit_length())
        workspace = _THREAD.workspace = Workspace(capacity)
    return workspace


@lru_cache(maxsize=PREPARED_KEPT)
def view_of(prepared: PreparedTemplate) -> TemplateView:
    """Return a print as the kernels take it."""
    return prepared.for_kernels()


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(prepared: PreparedTemplate | None, thread: int) -> NeighbourIndex:
    # one a thread: an index has scratch arrays
    assert prepared is not None
    return index_neighbours(prepared.neighbourhoods)


def match(
    a: PreparedTemplate, b: PreparedTemplate, scorer: EvidenceScorer | None = None
) -> tuple[Alignment, Evidence] | None:
    """Match print A with print B, in the order of their content; None if nothing is paired.

    If their content is the same, neither can come first: only the identity is its own inverse.
    """
    if a.key == b.key:
        similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
        identity = identity_alignment(a.points)
        return identity, score.gather_evidence(a, b, identity, similarity, scorer)
    capacity = max(len(a), len(b))
    workspace = workspace_for(capacity) if scorer is None else Workspace(capacity, scorer)
    workspace.load(a)
    return workspace.match(b, reference_first=False)


def similarities(
    probe: PreparedTemplate, references: PreparedPrints, first: int, last: int
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the similarities to the references from number `first` up to, not including, `last`.

    Also return the numbers of those whose content is too like the probe's to order the two by their
    first minutiae; their similarity is 0.
    """
    if last <= first:
        return np.zeros(0), np.empty(0, np.intp)
    order = canonical_order(probe, references, first, last)
    workspace = workspace_for(max(len(probe), references.most_minutiae))
    workspace.load(probe)
    similarity = workspace.similarities(references, first, order)
    return similarity, first + np.flatnonzero(order == NEITHER_FIRST)


def canonical_order(
    probe: PreparedTemplate, references: PreparedPrints, first: int, last: int
) -> NDArray[np.int8]:
    """Return which of the probe and each reference comes first, in the order of their keys.

    It is `REFERENCE_FIRST`, `PROBE_FIRST`, or `NEITHER_FIRST` where that takes the whole keys,
    which begin with the first minutiae's x. Between prints of too few minutiae it has no meaning.
    """
    start = references.minutiae_start[first:last]
    size = np.diff(references.minutiae_start[first : last + 1])
    order = np.full(len(start), PROBE_FIRST, np.int8)
    undecided = np.flatnonzero(size >= MIN_MINUTIAE)
    if len(probe) < MIN_MINUTIAE:
        return order
    order[undecided] = NEITHER_FIRST
    for k in range(min(ORDERED_BY, len(probe))):
        undecided = undecided[size[undecided] > k]
        theirs = _byte_order(references.xy[start[undecided] + k, 0].astype(np.float64))
        ours = _byte_order(probe.points[0, k : k + 1])
        order[undecided] = np.where(theirs < ours, REFERENCE_FIRST, PROBE_FIRST)
        undecided = undecided[theirs == ours]
        order[undecided] = NEITHER_FIRST
    return order


def _byte_order(x: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Return numbers in the order of the bytes of `x`."""
    given = np.ascontiguousarray(x, np.float64).view(np.uint64)
    return given.byteswap() if sys.byteorder == "little" else given

"""The pipeline: one print is matched with another, in a workspace that is used again."""

from __future__ import annotations

import threading
from dataclasses import fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline._kernels._evidence_kernel import EvidenceScorer
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import RidgeSearch
from fpmatch.matching.pipeline.alignment import (
    aligner_of,
    identity_alignment,
    index_neighbours,
    kept_alignment,
    local_similarity,
    make_aligner,
)
from fpmatch.matching.pipeline.evidence import Evidence
from fpmatch.matching.pipeline.parameters import USUAL, ScoreParameters
from fpmatch.matching.prints.bit_descriptors import prefilter, score_descriptors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex
    from fpmatch.matching.pipeline.alignment import Alignment
    from fpmatch.matching.pipeline.parameters import MatchParameters
    from fpmatch.matching.pipeline.score_model import ScoreWeights
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
    from fpmatch.matching.prints.prepared import BitDescriptors, PreparedTemplate

MIN_MINUTIAE: Final = 1  # the fewest that a print is compared by
PREPARED_KEPT: Final = 64  # views and indices of prints, used last: a fifth of a megabyte each
LEAST_CAPACITY: Final = 64  # minutiae, of a thread's workspace
COUNTS: Final = [k for k, entry in enumerate(fields(Evidence)) if entry.type == "int"]


class Workspace:
    """Compare a probe with one reference after the other, of `capacity` minutiae; for one thread.

    The scorer has the weights in the package unless one is given. `reference_first` is whether a
    reference comes first, in the order of the content.
    """

    def __init__(
        self,
        capacity: int,
        scorer: EvidenceScorer | None = None,
        parameters: MatchParameters = USUAL,
    ) -> None:
        p = self.parameters = parameters
        self.capacity = capacity
        self.weights = score.load_weights()
        self.scorer = evidence_scorer(capacity, None, p.score) if scorer is None else scorer
        before, after = (make_aligner(capacity, capacity, p) for _ in range(2))
        tables, search = prefilter(p.prefilter), RidgeSearch(p.ridges)
        self._kernel: Any = Pipeline(capacity, tables, before, after, self.scorer, search, p.local)
        self._probe: PreparedTemplate | None = None

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

    def pipeline(self) -> Any:
        """Return the kernel, with the probe and the index of its neighbours."""
        self._kernel.neighbours = _index_of(self._probe, threading.get_ident(), self.parameters)
        return self._kernel

    def match(
        self, reference: PreparedTemplate, *, reference_first: bool
    ) -> tuple[Alignment, Evidence] | None:
        """Match the probe with a reference; None if nothing is paired."""
        pipeline = self.pipeline()
        total = pipeline.match_with(view_of(reference), reference_first)
        if pipeline.best < 0:
            return None
        aligner = pipeline.before if reference_first else pipeline.after
        alignment = kept_alignment(aligner, pipeline.best)
        return alignment, evidence_of(self.scorer, total)


_THREAD: Final = threading.local()


def workspace_for(minutiae: int, parameters: MatchParameters = USUAL) -> Workspace:
    """Return the thread's own workspace, with capacity for prints of so many minutiae."""
    workspace: Workspace | None = getattr(_THREAD, "workspace", None)
    if (
        workspace is None
        or workspace.capacity < minutiae
        or workspace.parameters is not parameters
        or workspace.weights is not score.load_weights()
    ):
        capacity = max(LEAST_CAPACITY, 1 << (minutiae - 1).bit_length())
        workspace = _THREAD.workspace = Workspace(capacity, parameters=parameters)
    return workspace


@lru_cache(maxsize=PREPARED_KEPT)
def view_of(prepared: PreparedTemplate) -> TemplateView:
    """Return a print as the kernels take it."""
    return prepared.for_kernels()


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(
    prepared: PreparedTemplate | None, thread: int, parameters: MatchParameters
) -> NeighbourIndex:
    # one a thread: an index has scratch arrays
    assert prepared is not None
    return index_neighbours(prepared.neighbourhoods, parameters)


def match(
    a: PreparedTemplate,
    b: PreparedTemplate,
    scorer: EvidenceScorer | None = None,
    parameters: MatchParameters = USUAL,
) -> tuple[Alignment, Evidence] | None:
    """Match print A with print B, in the order of their content; None if nothing is paired.

    If their content is the same, neither can come first: only the identity is its own inverse.
    """
    if a.key == b.key:
        similarity = local_similarity(a.neighbourhoods, b.neighbourhoods, parameters)
        identity = identity_alignment(a.points)
        return identity, gather_evidence(a, b, identity, similarity, scorer, parameters)
    capacity = max(len(a), len(b))
    workspace = (
        workspace_for(capacity, parameters)
        if scorer is None
        else Workspace(capacity, scorer, parameters)
    )
    workspace.load(a)
    return workspace.match(b, reference_first=False)


def evidence_scorer(
    capacity: int, weights: ScoreWeights | None = None, parameters: ScoreParameters = USUAL.score
) -> EvidenceScorer:
    """Return what scores alignments with a print of up to `capacity` minutiae, for one thread."""
    return EvidenceScorer(parameters, weights or score.load_weights(), capacity)


def gather_evidence(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    similarity: NDArray[np.float32],
    scorer: EvidenceScorer | None = None,
    parameters: MatchParameters = USUAL,
) -> Evidence:
    """Gather and weigh the evidence for and against one finger in an alignment of two prints.

    `similarity` (N, M) is the local similarity of their minutiae; the scorer has the weights in the
    package unless one is given.
    """
    used = evidence_scorer(len(b), None, parameters.score) if scorer is None else scorer
    aligner = aligner_of(a.points, b.points, parameters)
    aligner.relax(similarity)
    aligner.impose(alignment.partner, *alignment.transform.tolist())
    total = used.score_alignment(a.for_kernels(), b.for_kernels(), aligner, similarity)
    return evidence_of(used, total)


def evidence_of(scorer: EvidenceScorer, minus_log_fmr: float) -> Evidence:
    """Return the evidence that was scored last, and came to `minus_log_fmr`."""
    entries, features = scorer.last_evidence()
    for k in COUNTS:
        entries[k] = int(entries[k])
    values = [*entries, np.array(features), float(scorer.total), float(minus_log_fmr)]
    return Evidence(*values)

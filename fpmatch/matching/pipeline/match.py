"""The pipeline: one print is matched with another, in a workspace that is used again."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline._kernels._alignment_kernel import Aligner
from fpmatch.matching.pipeline._kernels._evidence_kernel import EvidenceScorer
from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import RidgeSearch
from fpmatch.matching.pipeline.evidence import Evidence
from fpmatch.matching.prints._kernels._prefilter_kernel import Prefilter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.score_model import ScoreWeights
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
    from fpmatch.matching.prints.prepared import PreparedTemplate

PREPARED_KEPT: Final = 64  # views and indices of prints, used last: a fifth of a megabyte each
LEAST_CAPACITY: Final = 64  # minutiae, of a thread's workspace
COUNTS: Final = [k for k, entry in enumerate(fields(Evidence)) if entry.type == "int"]
CELL_PX: Final = 20.0  # side of the cells in which neighbours are looked up
HALF: Final = 7  # such cells from the middle to each border; both set the time it takes, no more


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The alignment of print A, of N minutiae, with print B."""

    transform: NDArray[np.float64]  # (s·cos θ, s·sin θ, tx, ty) at 500 dpi with y pointing up
    partner: NDArray[np.int32]  # (N,): the partner in B, or -1; one-to-one
    weight: NDArray[np.float64]  # (N,): how well a pair fits, 0 to 1; 0 where there is none


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
        self.scorer = evidence_scorer(capacity, None, p) if scorer is None else scorer
        tables, search = Prefilter(p), RidgeSearch(p)
        steps = make_aligner(capacity, capacity, p), self.scorer, search
        self._kernel: Any = Pipeline(capacity, tables, *steps, p)
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
        n = pipeline.aligner.size_a
        alignment = Alignment(np.empty(4), np.empty(n, np.int32), np.empty(n))
        arrays = alignment.transform, alignment.partner, alignment.weight
        pipeline.aligner.copy_kept(pipeline.best, *arrays)
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


def make_aligner(size_a: int, size_b: int, parameters: MatchParameters = USUAL) -> Aligner:
    """Return an empty aligner for prints of up to so many minutiae, for one thread."""
    return Aligner(size_a, size_b, parameters)


def evidence_scorer(
    capacity: int, weights: ScoreWeights | None = None, parameters: MatchParameters = USUAL
) -> EvidenceScorer:
    """Return what scores alignments with a print of up to `capacity` minutiae, for one thread."""
    return EvidenceScorer(parameters, weights or score.load_weights(), capacity)


@lru_cache(maxsize=PREPARED_KEPT)
def view_of(prepared: PreparedTemplate) -> TemplateView:
    """Return a print as the kernels take it."""
    return prepared.for_kernels()


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(
    prepared: PreparedTemplate | None, thread: int, parameters: MatchParameters
) -> NeighbourIndex:
    """Sort the neighbours of a print's minutiae so that similar ones are found at once.

    There is one a thread: an index has scratch arrays.
    """
    assert prepared is not None
    of = prepared.neighbourhoods
    turn = math.radians(parameters.neighbour_turn_deg)
    slack = 1.0 / (1.0 - parameters.tolerance_per_px)
    return NeighbourIndex(of.count, of.frame, CELL_PX, HALF, turn, slack, of.frame.shape[2])


def evidence_of(scorer: EvidenceScorer, minus_log_fmr: float) -> Evidence:
    """Return the evidence that was scored last, and came to `minus_log_fmr`."""
    entries, features = scorer.last_evidence()
    for k in COUNTS:
        entries[k] = int(entries[k])
    values = [*entries, np.array(features), float(scorer.total), float(minus_log_fmr)]
    return Evidence(*values)

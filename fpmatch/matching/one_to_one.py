"""Reusable workspace for one-to-one comparison, and the prints prepared for it last."""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from fpmatch.matching import score
from fpmatch.matching._one_to_one_kernel import OneToOne
from fpmatch.matching.align import make_aligner
from fpmatch.matching.bit_descriptors import prefilter
from fpmatch.matching.local import LocalParameters, index_neighbours

if TYPE_CHECKING:
    from fpmatch.matching._evidence_kernel import EvidenceScorer
    from fpmatch.matching._local_kernel import NeighbourIndex
    from fpmatch.matching._template_view_kernel import TemplateView
    from fpmatch.matching.prepare import PreparedTemplate

PREPARED_KEPT: Final = 64
"""Prints whose form for the kernels is kept, those used last: a fifth of a megabyte each."""

LEAST_CAPACITY: Final = 64


class Workspace:
    """Compare prints, two at a time; for one thread.

    Parameters
    ----------
    capacity : int
        The most minutiae of a print.
    scorer : EvidenceScorer, optional
        What scores (default: with the weights in the package).

    Attributes
    ----------
    aligner : Aligner
        Saves the best alignment of the two prints aligned last.
    scorer : EvidenceScorer
        Has its evidence.
    """

    def __init__(self, capacity: int, scorer: EvidenceScorer | None = None) -> None:
        local = LocalParameters()
        self.capacity = capacity
        self.weights = score.load_weights()
        self.aligner = make_aligner(capacity, capacity)
        self.scorer = score.evidence_scorer(capacity, self.weights) if scorer is None else scorer
        self._kernel = OneToOne(prefilter(), self.aligner, self.scorer, capacity, local)

    def prefilter(
        self, probe: PreparedTemplate, reference: PreparedTemplate, *, reference_first: bool
    ) -> float | None:
        """Compare two prints by their bit descriptors.

        Parameters
        ----------
        probe, reference : PreparedTemplate
            The two; it is quickest with one probe after the other.
        reference_first : bool
            Whether the reference comes first, by their content.

        Returns
        -------
        float or None
            What stands for -ln(FMR) of prints that the prefilter rejects; None where they pass.
        """
        shortfall: float = self._kernel.prefilter_shortfall(
            for_kernels(probe), for_kernels(reference), reference_first
        )
        return self.scorer.prefilter_rejected(shortfall) if shortfall > 0.0 else None

    def align(self, a: PreparedTemplate, b: PreparedTemplate) -> float | None:
        """Align print A with print B, in the order of their content.

        Returns
        -------
        float or None
            The weighted sum of the features, conditioned on how much was compared: an estimate of
            -ln(FMR); None where nothing is paired.
        """
        total: float = self._kernel.align(_index_of(a), for_kernels(a), for_kernels(b))
        return total if self.aligner.best_pairs else None


_OWN: Final = threading.local()


def workspace_for(minutiae: int) -> Workspace:
    """Return the thread's own workspace, with capacity for prints of so many minutiae."""
    found: Workspace | None = getattr(_OWN, "workspace", None)
    if found is None or found.capacity < minutiae or found.weights is not score.load_weights():
        capacity = max(LEAST_CAPACITY, 1 << (minutiae - 1).bit_length())
        found = _OWN.workspace = Workspace(capacity)
    return found


@lru_cache(maxsize=PREPARED_KEPT)
def for_kernels(print_: PreparedTemplate) -> TemplateView:
    """Return a print as the kernels see it."""
    return print_.for_kernels()


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(print_: PreparedTemplate) -> NeighbourIndex:
    # threads share it, with its scratch arrays: the kernel above holds Python's lock
    return index_neighbours(print_.neighbourhoods, LocalParameters(), comes_first=True)

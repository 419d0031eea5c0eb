"""The compiled pipeline of a thread, and what it keeps of prints for the next comparisons."""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline

if TYPE_CHECKING:
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
    from fpmatch.matching.prints.prepared import PreparedTemplate

PREPARED_KEPT: Final = 64  # views and indices of prints, used last: a fifth of a megabyte each
LEAST_CAPACITY: Final = 64  # minutiae, of a thread's pipeline
_THREAD: Final = threading.local()


def pipeline_for(
    probe: PreparedTemplate, minutiae: int, parameters: MatchParameters = USUAL
) -> Pipeline:
    """Return the thread's own pipeline, which holds a probe, for prints of so many minutiae.

    `minutiae` is the number of those of the larger print.
    """
    pipeline: Pipeline | None = getattr(_THREAD, "pipeline", None)
    if (
        pipeline is None
        or pipeline.capacity < minutiae
        or pipeline.parameters is not parameters
        or pipeline.weights is not score.load_weights()
    ):
        capacity = max(LEAST_CAPACITY, 1 << (minutiae - 1).bit_length())
        pipeline = _THREAD.pipeline = Pipeline(capacity, parameters, score.load_weights())
    pipeline.load(view_of(probe))
    return pipeline


def index_neighbours(pipeline: Any, probe: PreparedTemplate) -> None:
    """Let a pipeline have the index of the neighbours of the probe that it holds."""
    pipeline.neighbours = _index_of(probe, threading.get_ident(), pipeline.parameters)


@lru_cache(maxsize=PREPARED_KEPT)
def view_of(prepared: PreparedTemplate) -> TemplateView:
    """Return a print as the kernels take it."""
    return prepared.for_kernels()


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(
    prepared: PreparedTemplate, thread: int, parameters: MatchParameters
) -> NeighbourIndex:
    """Sort the neighbours of a print's minutiae so that similar ones are found at once.

    There is one a thread: an index has scratch arrays.
    """
    return NeighbourIndex(prepared.neighbourhoods.count, prepared.neighbourhoods.frame, parameters)

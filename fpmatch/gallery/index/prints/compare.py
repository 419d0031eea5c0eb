"""One print is compared with many at once, to the last bit as with one after the other."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final, TypeGuard

import numpy as np

from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.constants.comparison import MIN_MINUTIAE
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.parameters import USUAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.result import Matcher

if COMPILED:
    from fpmatch.matching.matchers.unit_circle import index_neighbours, pipeline_for
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView

ORDERED_BY: Final = 3  # minutiae that decide which print comes first, before the whole keys do
NEITHER_FIRST: Final = 0
REFERENCE_FIRST: Final = -1
PROBE_FIRST: Final = 1


def packs(matcher: Matcher) -> TypeGuard[UnitCircleMatcher]:
    """Return whether what a matcher prepares can be packed: it is what the default one prepares.

    What one with other parameters prepares is in no file, index or array of many prints.
    """
    return isinstance(matcher, UnitCircleMatcher) and matcher.parameters is USUAL


def similarities(
    matcher: Matcher,
    probe: PreparedTemplate,
    references: PreparedPrints,
    first: int = 0,
    last: int | None = None,
) -> NDArray[np.float64]:
    """Compare one print with those from `first` up to, not including, `last`.

    The similarities are to the last bit those that the matcher's `compare` finds.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
    >>> from fpmatch.matching.matchers.unit_circle import MATCHER
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> print_ = MATCHER.prepare(Template(minutiae, 100, 100))
    >>> similarity = similarities(MATCHER, print_, PreparedPrints.pack([print_, print_]))
    >>> bool(similarity[1] == MATCHER.compare(print_, print_).similarity)
    True
    """
    first, last, _ = slice(first, last).indices(len(references))
    similarity, order = np.zeros(max(last - first, 0)), np.full(max(last - first, 0), NEITHER_FIRST)
    own = getattr(type(matcher), "compare", None) is UnitCircleMatcher.compare
    if own and packs(matcher) and not matcher.by_reference and len(similarity):
        order = canonical_order(probe, references, first, last)
        _fill(similarity, probe, references, first, order)
    for k in np.flatnonzero(order == NEITHER_FIRST).tolist():
        similarity[k] = matcher.compare(probe, references[first + k]).similarity
    return similarity


def _fill(
    similarity: NDArray[np.float64],
    probe: PreparedTemplate,
    references: PreparedPrints,
    first: int,
    order: NDArray[np.int8],
) -> None:
    """Write the similarities to references from number `first` on, where one of two comes first."""
    n, size = max(len(probe), references.most_minutiae), references.neighbour.shape[1]
    pipeline = pipeline_for(probe, n)
    index_neighbours(pipeline, probe)
    arrays = np.empty((4, n)), np.empty(n), np.empty(n, np.int32)
    reference = TemplateView(*arrays, np.empty((n, 6, size), np.float32))
    references.view.match(pipeline, reference, first, order, similarity)


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

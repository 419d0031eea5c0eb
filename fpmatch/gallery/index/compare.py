"""One print is compared with many at once, to the last bit as with one after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from fpmatch.matching.constants import COMPILED
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.parameters import USUAL

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.result import Matcher

if COMPILED:
    from fpmatch.gallery.index._compare_kernel import compare_each
    from fpmatch.matching.matchers.unit_circle import index_neighbours, pipeline_for
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView


def packs(matcher: Matcher) -> TypeGuard[UnitCircleMatcher]:
    """Return whether what a matcher prepares is what the default one prepares.

    What one with other parameters prepares is in no index, and is compared one by one.
    """
    return isinstance(matcher, UnitCircleMatcher) and matcher.parameters is USUAL


class PreparedPrints:
    """Prints that the default matcher prepared, with which a probe is compared at once."""

    def __init__(self, prints: Iterable[PreparedTemplate]) -> None:
        self.prints = list(prints)
        self.views = [TemplateView(print_) for print_ in self.prints] if COMPILED else []

    def __len__(self) -> int:
        return len(self.prints)

    def take(self, places: Sequence[int]) -> PreparedPrints:
        """Return the prints at some places, in this order."""
        taken = PreparedPrints([])
        taken.prints = [self.prints[k] for k in places]
        taken.views = [self.views[k] for k in places] if self.views else []
        return taken


def similarities(
    matcher: Matcher,
    probe: PreparedTemplate,
    references: PreparedPrints,
) -> NDArray[np.float64]:
    """Compare one print with many.

    The similarities are to the last bit those that the matcher's `compare` finds.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.matching.matchers.unit_circle import MATCHER
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> print_ = MATCHER.prepare(Template(minutiae, 100, 100))
    >>> similarity = similarities(MATCHER, print_, PreparedPrints([print_, print_]))
    >>> bool(similarity[1] == MATCHER.compare(print_, print_).similarity)
    True
    """
    some, key = references.prints, probe.key
    similarity, order = np.zeros(len(some)), np.zeros(len(some), np.int8)
    own = getattr(type(matcher), "compare", None) is UnitCircleMatcher.compare
    if own and packs(matcher) and not matcher.by_reference and some:
        # which of two prints comes first, by their content, decides how they are compared
        order[:] = [(one.key > key) - (one.key < key) for one in some]
        pipeline = pipeline_for(probe)
        index_neighbours(pipeline, probe)
        compare_each(pipeline, references.views, order, similarity)
        similarity = np.logaddexp(0.0, similarity)
    for k in np.flatnonzero(order == 0).tolist():
        similarity[k] = matcher.compare(probe, some[k]).similarity
    return similarity

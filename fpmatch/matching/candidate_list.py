"""Candidate list: the prints that are likeliest to match a probe, by their bit descriptors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.bit_descriptors import prefilter_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.packed_templates import PackedTemplates
    from fpmatch.matching.prepare import PreparedTemplate

SIZE_OFFSET: Final = 5
"""Added to the minutiae of the smaller print, by which its score is divided."""


def prefilter_scores(
    probe: PreparedTemplate, prints: PackedTemplates, first: int = 0, last: int | None = None
) -> NDArray[np.int32]:
    """Return how much the bit descriptors of each print from `first` to `last` have in common."""
    first, last, _ = slice(first, last).indices(len(prints))
    found = np.zeros(max(last - first, 0), np.int32)
    m = prints
    bits = m.direction_bin, m.neighbour_bits, m.orientation_bins, m.has_flow
    prefilter_of(probe.bit_descriptors).score_many(first, m.minutiae_start, m.xy, *bits, found)
    return found


def normalized_prefilter_scores(
    probe: PreparedTemplate, prints: PackedTemplates
) -> NDArray[np.float64]:
    """Return the prefilter's scores, normalized by the size of the smaller print."""
    smaller = np.minimum(np.diff(prints.minutiae_start), len(probe))
    found: NDArray[np.float64] = prefilter_scores(probe, prints) / (smaller + SIZE_OFFSET)
    return found


def candidate_list(
    probe: PreparedTemplate, prints: PackedTemplates, count: int
) -> NDArray[np.intp]:
    """Return the numbers, ascending, of the `count` prints of the greatest normalized scores.

    Of equals, the first are taken.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.matching.prepare import prepare
    >>> from fpmatch.matching.packed_templates import PackedTemplates
    >>> near = Minutiae([50, 90, 60, 70, 85, 30], [40, 50, 80, 60, 90, 60], [0, 1, 2, 3, 4, 5])
    >>> far = Minutiae([20, 150, 60, 70, 9, 80], [40, 50, 80, 160, 90, 90], [3, 1, 0, 2, 5, 1])
    >>> prints = [prepare(Template(m, 200, 200)) for m in (far, near, far)]
    >>> candidate_list(prints[1], PackedTemplates.pack(prints), 1).tolist()
    [1]
    """
    if count >= len(prints):
        return np.arange(len(prints))
    order = np.argsort(-normalized_prefilter_scores(probe, prints), kind="stable")
    return np.sort(order[: max(count, 0)])

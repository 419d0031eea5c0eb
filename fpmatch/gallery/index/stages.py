"""The first stage of a search: which prints of a segment the next stage looks at."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.gallery.index.model import index_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.segment import Segment
    from fpmatch.gallery.index.terms import ProbeTerms

_NO_NUMBERS = np.empty(0, np.int64)


def most_voted(votes: NDArray[np.uint16], most: int) -> NDArray[np.intp]:
    """Return the places, ascending, of the `most` prints with the most votes; of equals, the first.

    Examples
    --------
    >>> most_voted(np.array([3, 1, 7, 3, 3], np.uint16), 3).tolist()
    [0, 2, 3]
    """
    if len(votes) <= most:
        return np.arange(len(votes))
    if most <= 0:
        return np.empty(0, np.intp)
    least = np.partition(votes, len(votes) - most)[len(votes) - most]
    chosen = votes > least
    chosen[np.flatnonzero(votes == least)[: most - np.count_nonzero(chosen)]] = True
    return np.flatnonzero(chosen)


def preselect(
    segments: Sequence[Segment],
    terms: ProbeTerms,
    most: int,
    removed: NDArray[np.int64] = _NO_NUMBERS,
) -> tuple[NDArray[np.intp], NDArray[np.uint16]]:
    """Return the places of the `most` prints of adjacent segments with the most votes, and these.

    Prints with the numbers `removed` are left out. Where the numbers of segments ascend, the
    `most_voted` prints of the results of all are those of the whole index, however it is divided.
    """
    votes = np.concatenate([segment.votes(terms) for segment in segments])
    if not len(removed):
        place = most_voted(votes, most)
        return place, votes[place]
    numbers = np.concatenate([segment.number for segment in segments])
    left = np.flatnonzero(~np.isin(numbers, removed))
    place = left[most_voted(votes[left], most)]
    return place, votes[place]


def unoriented_share(segments: Sequence[Segment]) -> float:
    """Return about which share of the prints have no ridge orientation, in quarters.

    Where they have one, it is still not known across some edges at the border of the print.
    """
    postings = sum(len(segment.posting) for segment in segments)
    unknown = sum(segment.unknown_curvatures for segment in segments) / max(postings, 1)
    expected = float(index_model().directions[..., -1].sum())
    share = (unknown - expected) / (1.0 - expected) if expected < 1.0 else 0.0
    return round(4 * max(share, 0.0)) / 4

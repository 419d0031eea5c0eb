"""Which prints of a large gallery are compared with a probe, by its index, in two stages.

The terms and the embedding of the probe choose prints whose bit descriptors are scored, and these
the prints that are compared whole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.gallery.index.segment import Segment, unoriented_share
from fpmatch.gallery.index.size_normalization import size_normalized
from fpmatch.gallery.index.terms import probe_terms

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.gallery.engine.in_threads import Threads
    from fpmatch.gallery.index.follow import GalleryIndex
    from fpmatch.matching.prints.prepared import PreparedTemplate

# What the stages pass on at effort 1; see docs/explanation/searching.md.
LEAST_BY_TERMS: Final = 2000
SHARE_BY_TERMS: Final = 0.011
BY_DESCRIPTORS: Final = 250
VOTE_WEIGHT: Final = 1 / 256
"""What a vote adds to the normalized score of the bit descriptors."""


def shortlist(
    index: GalleryIndex, probe: PreparedTemplate, effort: int, least: int, threads: Threads
) -> tuple[list[int], tuple[int, int]]:
    """Return the numbers of prints that may be of the probe's finger, ascending, `least` or more.

    Also return how many prints each stage has passed on.
    """
    segments = index.segments
    by_descriptors = max(effort * BY_DESCRIPTORS, least)
    by_terms = effort * max(LEAST_BY_TERMS, round(SHARE_BY_TERMS * len(index.numbers)))
    terms = probe_terms(probe, unoriented=unoriented_share(segments))
    counted = threads.map(lambda terms, segment: segment.votes(terms), terms, segments)
    votes = np.concatenate([np.empty(0, np.uint16), *counted])[index.stored]
    first = most_voted(votes, max(by_terms, by_descriptors))
    first = first[np.argsort(index.stored[first])]
    places = index.stored[first]
    start = np.cumsum([0, *map(len, segments)])
    bounds = np.searchsorted(places, start)
    parts = [
        (segment, places[bounds[k] : bounds[k + 1]] - start[k])
        for k, segment in enumerate(segments)
    ]
    scores = np.concatenate([np.empty(0, np.int32), *threads.map(_scores, probe, parts)])
    sizes = np.concatenate([np.empty(0, np.uint8), *(one.size for one in segments)])[places]
    # Either finds mates that the other loses: votes need a mesh that both prints have,
    # descriptors the ridges around the minutiae.
    combined = size_normalized(scores, sizes, len(probe)) + VOTE_WEIGHT * votes[first]
    second = first[np.argsort(-combined, kind="stable")[:by_descriptors]]
    return np.sort(index.numbers[second]).tolist(), (len(first), len(second))


def most_voted(votes: NDArray[np.uint16], most: int) -> NDArray[np.intp]:
    """Return the places, ascending, of the `most` prints with the most votes; of equals, the first.

    Examples
    --------
    >>> most_voted(np.array([3, 1, 7, 3, 3], np.uint16), 3).tolist()
    [0, 2, 3]
    """
    if len(votes) <= most:
        return np.arange(len(votes))
    least = np.partition(votes, len(votes) - most)[len(votes) - most]
    chosen = votes > least
    chosen[np.flatnonzero(votes == least)[: most - np.count_nonzero(chosen)]] = True
    return np.flatnonzero(chosen)


def _scores(probe: PreparedTemplate, part: tuple[Segment, NDArray[np.intp]]) -> NDArray[np.int32]:
    segment, which = part
    return segment.scores(probe, which)

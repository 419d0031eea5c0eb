"""Which prints of a large gallery are compared with a probe, by its index, in two stages.

The terms and the embedding of the probe choose prints whose bit descriptors are scored, and these
the prints that are compared whole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.gallery.index.segment import unoriented_share
from fpmatch.gallery.index.size_normalization import size_normalized
from fpmatch.gallery.index.terms import probe_terms

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

    from numpy.typing import NDArray

    from fpmatch.gallery.index.follow import GalleryIndex
    from fpmatch.matching.prints.prepared import PreparedTemplate

# What the stages pass on at effort 1; see docs/explanation/searching.md.
LEAST_BY_TERMS: Final = 2000
SHARE_BY_TERMS: Final = 0.011
LEAST_BY_DESCRIPTORS: Final = 120
SHARE_BY_DESCRIPTORS: Final = 0.00025
UNIT: Final = 256  # of the agreement of prints: a standard deviation
AGREEMENT_WEIGHT: Final = 0.3 / UNIT
"""What the agreement adds to the normalized score of the bit descriptors."""
SAMPLE: Final = 65_536  # prints, about, by which a standard deviation is estimated


def shortlist(
    index: GalleryIndex,
    probe: PreparedTemplate,
    effort: int,
    least: int,
    threads: ThreadPoolExecutor,
) -> tuple[list[int], tuple[int, int]]:
    """Return the numbers of prints that may be of the probe's finger, ascending, `least` or more.

    Also return how many prints each stage has passed on.
    """
    segments = index.segments
    size = len(index.numbers)
    by_descriptors = effort * max(LEAST_BY_DESCRIPTORS, round(SHARE_BY_DESCRIPTORS * size))
    by_descriptors = max(by_descriptors, least)
    by_terms = effort * max(LEAST_BY_TERMS, round(SHARE_BY_TERMS * size))
    terms = probe_terms(probe, unoriented=unoriented_share(segments))
    counted = threads.map(lambda segment: segment.votes(terms), segments)
    both = np.concatenate([np.empty((2, 0), np.uint16), *counted], axis=1)
    agreed = agreement(both[:, index.stored])
    first = most_agreeing(agreed, max(by_terms, by_descriptors))
    first = first[np.argsort(index.stored[first])]
    places = index.stored[first]
    start = np.cumsum([0, *map(len, segments)])
    bounds = np.searchsorted(places, start)
    parts = [
        (segment, places[bounds[k] : bounds[k + 1]] - start[k])
        for k, segment in enumerate(segments)
    ]
    scores = np.concatenate(
        [np.empty(0, np.int32), *threads.map(lambda part: part[0].scores(probe, part[1]), parts)]
    )
    sizes = np.concatenate([np.empty(0, np.uint8), *(one.size for one in segments)])[places]
    # Either finds mates that the other loses: votes need a mesh that both prints have,
    # descriptors the ridges around the minutiae.
    combined = size_normalized(scores, sizes, len(probe)) + AGREEMENT_WEIGHT * agreed[first]
    second = first[np.argsort(-combined, kind="stable")[:by_descriptors]]
    return np.sort(index.numbers[second]).tolist(), (len(first), len(second))


def agreement(counted: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return how far prints agree with a probe, (N,), by the numbers of `Segment.votes`, (2, N).

    It is the sum of votes and similarity of the embeddings, each divided by its standard deviation
    in the gallery, in 256ths.

    Examples
    --------
    >>> agreement(np.array([[0, 0, 300], [500, 700, 600]], np.uint16)).tolist()
    [1567, 2194, 2424]
    """
    if not counted.size:
        return np.empty(0, np.uint16)
    deviation = counted[:, :: 1 + counted.shape[1] // SAMPLE].std(axis=1)
    scale = (UNIT / np.maximum(deviation, 1.0)).astype(np.float32)
    total = counted[0] * scale[0] + counted[1] * scale[1]
    agreed: NDArray[np.uint16] = np.minimum(total, 65_535).astype(np.uint16)
    return agreed


def most_agreeing(agreed: NDArray[np.uint16], most: int) -> NDArray[np.intp]:
    """Return the places, ascending, of the `most` prints that agree most; of equals, the first.

    Examples
    --------
    >>> most_agreeing(np.array([3, 1, 7, 3, 3], np.uint16), 3).tolist()
    [0, 2, 3]
    """
    if len(agreed) <= most:
        return np.arange(len(agreed))
    least = np.partition(agreed, len(agreed) - most)[len(agreed) - most]
    chosen = agreed > least
    chosen[np.flatnonzero(agreed == least)[: most - np.count_nonzero(chosen)]] = True
    return np.flatnonzero(chosen)

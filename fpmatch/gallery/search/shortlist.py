"""Which prints of a large gallery are compared with a probe, by its index, in two stages.

The terms and the embedding of the probe choose prints whose bit descriptors are scored, and these
the prints that are compared whole.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.threads import chunks_of
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
SHARE_BY_TERMS: Final = 0.015
LEAST_BY_DESCRIPTORS: Final = 120
SHARE_BY_DESCRIPTORS: Final = 0.0002
SIZE_WEIGHT: Final = 0.5  # of the logarithm of the share of prints that are not larger
VOTES_WEIGHT: Final = 0.07  # of the square of the votes, where descriptors are known
SAMPLE: Final = 65_536  # prints, about, by which means and deviations are estimated
SEGMENTS_AT_ONCE: Final = 4  # of one thread, before it takes others


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
    segments, size = index.segments, len(index.numbers)
    if not size:  # all are damaged
        return [], (0, 0)
    by_descriptors = effort * max(LEAST_BY_DESCRIPTORS, round(SHARE_BY_DESCRIPTORS * size))
    by_descriptors = max(by_descriptors, least)
    by_terms = effort * max(LEAST_BY_TERMS, round(SHARE_BY_TERMS * size))
    terms = probe_terms(probe, unoriented=unoriented_share(segments))
    some_segments = chunks_of(segments, SEGMENTS_AT_ONCE)
    counted = threads.map(lambda some: [one.votes(terms) for one in some], some_segments)
    both = np.concatenate([*chain.from_iterable(counted)], axis=1)
    sizes = np.concatenate([segment.size for segment in segments])
    if not index.in_order:
        both, sizes = both[:, index.stored], sizes[index.stored]
    step = 1 + size // SAMPLE
    mean, deviation = both[:, ::step].mean(axis=1), both[:, ::step].std(axis=1)
    scale = (1.0 / np.maximum(deviation, 1.0)).astype(np.float32)
    of_size = by_size(sizes[::step])
    agreed = both[0] * scale[0]
    agreed += both[1] * scale[1]
    agreed += of_size.take(sizes)
    most = min(max(by_terms, by_descriptors), size)
    first = np.flatnonzero(agreed >= np.partition(agreed, size - most)[size - most])
    first = first[np.argsort(index.stored[first])]
    places = index.stored[first]
    start = np.cumsum([0, *map(len, segments)])
    bounds = np.searchsorted(places, start)
    parts = [
        (segment, places[bounds[k] : bounds[k + 1]] - start[k])
        for k, segment in enumerate(segments)
    ]
    some_parts = chunks_of(parts, SEGMENTS_AT_ONCE)
    scored = threads.map(lambda some: [one.scores(probe, k) for one, k in some], some_parts)
    scores = np.concatenate([*chain.from_iterable(scored)])
    # Either finds mates that the other loses: votes need a mesh that both prints have,
    # descriptors the ridges around the minutiae. By chance, few prints have very many votes.
    votes = np.maximum(both[0, first] - mean[0], 0.0) * scale[0]
    combined = size_normalized(scores, sizes[first], len(probe)) + of_size[sizes[first]]
    combined += VOTES_WEIGHT * votes * votes + both[1, first] * scale[1]
    second = first[np.argsort(-combined, kind="stable")[:by_descriptors]]
    return np.sort(index.numbers[second]).tolist(), (len(first), len(second))


def by_size(sizes: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return what is added for each size of a print, (256,), by the `sizes` of many in a gallery.

    Mates with few minutiae have few votes and words. The fewer prints are as small, the more is
    added, in standard deviations of votes: nothing where all are of one size.

    Examples
    --------
    >>> print(by_size(np.array([12, 30, 40, 40], np.uint8))[[12, 30, 40]].round(2))
    [0.46 0.26 0.  ]
    """
    not_larger = 1 + np.cumsum(np.bincount(sizes, minlength=256))
    added: NDArray[np.float64] = SIZE_WEIGHT * np.log(not_larger[-1] / not_larger)
    return added.astype(np.float32)

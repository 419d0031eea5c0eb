"""Search of a large gallery in one round of three stages, by its index.

The terms and the embedding of the probe choose prints whose bit descriptors are scored, and these
the prints that are compared whole, by the templates in the gallery.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.index.compare import PreparedPrints, similarities
from fpmatch.gallery.index.segment import unoriented_share
from fpmatch.gallery.index.size_normalization import size_normalized
from fpmatch.gallery.index.terms import probe_terms
from fpmatch.gallery.search.search import GallerySubjects, Search
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.in_threads import Threads
    from fpmatch.gallery.index.follow import GalleryIndex
    from fpmatch.gallery.index.segment import Segment
    from fpmatch.gallery.index.terms import ProbeTerms
    from fpmatch.gallery.search.search import SearchOptions, Similarity
    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.result import Matcher

# What the stages pass on at effort 1; see docs/explanation/searching.md.
LEAST_BY_TERMS: Final = 2000
SHARE_BY_TERMS: Final = 0.011
BY_DESCRIPTORS: Final = 250
VOTE_WEIGHT: Final = 1 / 256
"""What a vote adds to the normalized score of the bit descriptors."""
PREPARED_AT_ONCE: Final = 64  # prints that one thread prepares and compares before it takes others


class IndexedSearch(Search):
    """The prints of an open gallery, as its index followed it last."""

    preselected = True
    subjects: GallerySubjects

    def __init__(self, gallery: Gallery, index: GalleryIndex) -> None:
        self.matcher, self.index, self.gallery = index.matcher, index, gallery
        self.subjects = GallerySubjects(gallery)
        self.numbers, self.damaged = index.numbers, dict.fromkeys(index.damaged, "")
        self._segments, self._stored = index.segments, index.stored
        self._size = np.concatenate([np.empty(0, np.uint8), *(s.size for s in self._segments)])
        self._start = np.cumsum([0, *map(len, self._segments)])
        self._unoriented = unoriented_share(self._segments)

    def take_gallery(self, gallery: Gallery) -> None:
        """Read from the same gallery, as it was opened again."""
        self.gallery = self.subjects.gallery = gallery

    def compare(
        self, probe: Any, options: SearchOptions, threads: Threads
    ) -> tuple[Similarity, tuple[int, ...]]:
        """Compare a probe with the prints that terms, embedding and descriptors choose."""
        by_terms = options.effort * max(LEAST_BY_TERMS, round(SHARE_BY_TERMS * len(self)))
        by_descriptors = max(options.effort * BY_DESCRIPTORS, options.count)
        terms = probe_terms(probe, unoriented=self._unoriented)
        votes = np.concatenate([*threads.map(_votes, terms, self._segments)])[self._stored]
        first = most_voted(votes, max(by_terms, by_descriptors))
        first = first[np.argsort(self._stored[first])]
        places = self._stored[first]
        bounds = np.searchsorted(places, self._start)
        parts = [
            (segment, places[bounds[k] : bounds[k + 1]] - self._start[k])
            for k, segment in enumerate(self._segments)
        ]
        scores = np.concatenate([*threads.map(_scores, probe, parts)])
        # Either finds mates that the other loses: votes need a mesh that both prints have,
        # descriptors the ridges around the minutiae.
        combined = size_normalized(scores, self._size[places], len(probe))
        combined += VOTE_WEIGHT * votes[first]
        second = first[np.argsort(-combined, kind="stable")[:by_descriptors]]
        similarity = self.compare_some(probe, np.sort(self.numbers[second]).tolist(), threads)
        return similarity, (len(first), len(second))

    def compare_some(self, probe: Any, numbers: Sequence[int], threads: Threads) -> Similarity:
        """Compare a probe with the prints of some entries; those that are gone are left out."""
        rows = sorted(self.gallery.packed_templates(of=numbers))
        chunks = [rows[k : k + PREPARED_AT_ONCE] for k in range(0, len(rows), PREPARED_AT_ONCE)]
        parts = threads.map(partial(_similarities, self.matcher), probe, chunks)
        compared = np.concatenate([np.empty(0), *parts]).tolist()
        return dict(zip((number for number, _ in rows), compared, strict=True))

    def print_of(self, number: int) -> Any:
        """Return a print as the matcher prepares it; None where it is gone."""
        template = self.gallery.find_template(number)
        return None if template is None else self.matcher.prepare(template)


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


def _votes(terms: ProbeTerms, segment: Segment) -> NDArray[np.uint16]:
    return segment.votes(terms)


def _scores(probe: PreparedTemplate, part: tuple[Segment, NDArray[np.intp]]) -> NDArray[np.int32]:
    segment, which = part
    return segment.scores(probe, which)


def _similarities(
    matcher: Matcher, probe: PreparedTemplate, rows: Sequence[tuple[int, bytes]]
) -> NDArray[np.float64]:
    """Return the similarities of a probe to packed templates."""
    prints = [matcher.prepare(unpack_template(data)) for _, data in rows]
    return similarities(matcher, probe, PreparedPrints(prints))

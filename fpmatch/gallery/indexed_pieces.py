"""Searches in stages for many probes on all cores or machines: workers hold segments of the index.

Each segment returns its part of a stage; from the parts of all segments follows what is passed on
to the next stage. So the candidates are the same as in `fpmatch.gallery.indexed_search`, to the
last bit.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.engine.pieces import map_to_all
from fpmatch.gallery.index.loss import DEFAULT_LOSS, combined_scores, search_plan
from fpmatch.gallery.index.stages import preselect, unoriented_share
from fpmatch.gallery.indexed_search import IndexedSearch
from fpmatch.gallery.prepared_search import Preselection
from fpmatch.gallery.search_pieces import by_probe
from fpmatch.matching.prints.compact_template import prepare_compact

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.pieces import Pieces
    from fpmatch.gallery.index.loss import SearchPlan
    from fpmatch.gallery.index.print_segment import PrintSegment
    from fpmatch.gallery.prepared_search import CandidateListSize, Each, Search
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.result import Matcher

    Indices = NDArray[np.intp]

LEAST_PIECES: Final = 4  # fewer segments are held by several workers


@dataclass(frozen=True, slots=True, eq=False)
class IndexedPiece:
    """A segment of an index, and which of its entries were removed."""

    matcher: Matcher
    segment: PrintSegment
    removed: NDArray[np.int64]


class AnsweredIndexedSearch(IndexedSearch):
    """A search for one probe, whose preselected prints have been compared."""

    def __init__(
        self, search: IndexedSearch, staged: Preselection, similarities: NDArray[np.float64]
    ) -> None:
        self.__dict__.update(search.__dict__, _staged=staged, _similarities=similarities)

    _staged: Preselection
    _similarities: NDArray[np.float64]

    def current(self, gallery: GalleryReader) -> Search:
        """Return this search."""
        return self

    def preselect(
        self, probe: Any, loss: float, count: int, threshold: float = 0.0, each: Each = map
    ) -> Preselection:
        """Return what the stages chose."""
        return self._staged

    def similarities(
        self, probe: Any, which: Indices | None = None, each: Each = map
    ) -> NDArray[np.float64]:
        """Return the similarities to these prints, or compare with others."""
        if which is self._staged.places:
            return self._similarities
        return super().similarities(probe, which, each)


@dataclass(slots=True, eq=False)
class _Batch:
    """Prepared probes, and prints chosen for each."""

    probes: Sequence[Any]
    segments: list[Indices] = field(default_factory=list)
    local: list[Indices] = field(default_factory=list)
    votes: list[NDArray[np.uint16]] = field(default_factory=list)
    staged: list[Preselection] = field(default_factory=list)

    def within(self, segment: int) -> tuple[Sequence[Any], list[Indices]]:
        """Return the probes, and the chosen prints of a segment for each."""
        chosen = zip(self.local, self.segments, strict=True)
        return self.probes, [local[of == segment] for local, of in chosen]


def divide_index(search: IndexedSearch) -> list[IndexedPiece]:
    """Return the segments of an index, of few of them several copies in the same memory."""
    removed, segments = search.state.removed, search.state.segments
    gone = [removed[np.isin(removed, segment.numbers)] for segment in segments]
    pieces = [IndexedPiece(search.matcher, *one) for one in zip(segments, gone, strict=True)]
    return pieces * (-(-LEAST_PIECES // len(pieces)) if pieces else 1)


class HeldIndexedSearch:
    """Search in stages with the workers of an engine, which hold the segments."""

    def __init__(self, search: IndexedSearch, held: Pieces[IndexedPiece]) -> None:
        self.search, self._held = search, held
        self._segments = search.state.segments
        self._copies = -(-LEAST_PIECES // max(1, len(self._segments)))
        search.finger_of.max(initial=0)  # grouped once, for all answers

    def answers(
        self,
        batches: Iterable[Sequence[Any]],
        *,
        count: int = 10,
        candidate_list: CandidateListSize = "auto",
        loss: float = DEFAULT_LOSS,
        threshold: float = 0.0,
    ) -> Generator[list[tuple[Preselection, NDArray[np.float64]]], None, None]:
        """Yield what each probe of each batch is answered; as `HeldSearch.answers`."""
        plan = search_plan(loss, len(self.search), threshold)
        with (
            closing(self._voted(map(_Batch, batches), max(plan.by_terms, count), plan)) as voted,
            closing(self._chosen(voted, max(plan.by_descriptors, count), loss)) as chosen,
            closing(self._round(_compare, chosen, _Batch.within)) as compared,
        ):
            for batch, parts in compared:
                similarities = map(np.concatenate, by_probe(parts, len(batch.probes)))
                yield list(zip(batch.staged, similarities, strict=True))

    def answered(self, answer: Any) -> Search:
        """Return the search with which `identify` finds the candidates of an answered probe."""
        return AnsweredIndexedSearch(self.search, *answer)

    def _round(
        self,
        work: Callable[[None, IndexedPiece, Any], Any],
        batches: Iterable[_Batch],
        chunk_of: Callable[[_Batch, int], Any],
    ) -> Generator[tuple[_Batch, list[Any]], None, None]:
        """Return batches with the results of all segments."""
        total, copies = len(self._segments), self._copies
        return map_to_all(self._held, total, work, batches, chunk_of, copies=copies)

    def _voted(
        self, batches: Iterable[_Batch], most: int, plan: SearchPlan
    ) -> Generator[_Batch, None, None]:
        """Yield batches with the prints that the terms of the index choose."""
        limits = most, plan.budget, unoriented_share([one.terms for one in self._segments])
        with closing(
            self._round(_vote, batches, lambda batch, _: (batch.probes, *limits))
        ) as voted:
            for batch, parts in voted:
                for of_probe in by_probe(parts, len(batch.probes)):
                    self._choose_by_votes(batch, of_probe, most)
                yield batch

    def _choose_by_votes(self, batch: _Batch, voted: Sequence[Any], most: int) -> None:
        """Keep the prints with the most votes, as `fpmatch.gallery.index.stages.preselect` does."""
        segment = np.repeat(np.arange(len(voted)), [len(local) for local, _ in voted])
        local = np.concatenate([np.empty(0, np.intp), *(local for local, _ in voted)])
        votes = np.concatenate([np.empty(0, np.uint16), *(votes for _, votes in voted)])
        if len(votes) > most:
            number = self._numbers(voted)
            kept = np.sort(np.lexsort((number, -votes.astype(np.int64)))[:most])
            segment, local, votes = segment[kept], local[kept], votes[kept]
        batch.segments.append(segment)
        batch.local.append(local)
        batch.votes.append(votes)

    def _numbers(self, voted: Sequence[tuple[Indices, Any]]) -> NDArray[np.int64]:
        of_each = zip(self._segments, voted, strict=True)
        return np.concatenate([segment.numbers[local] for segment, (local, _) in of_each])

    def _chosen(
        self, batches: Iterable[_Batch], most: int, loss: float
    ) -> Generator[_Batch, None, None]:
        """Yield batches with the prints that the descriptors choose of those."""
        state = self.search.state
        with closing(self._round(_score, batches, _Batch.within)) as scored:
            for batch, parts in scored:
                for i, of_probe in enumerate(by_probe(parts, len(batch.probes))):
                    segment, local = batch.segments[i], batch.local[i]
                    sizes = np.concatenate([np.empty(0, np.int32), *(one[1] for one in of_probe)])
                    scores = np.concatenate([np.empty(0, np.int32), *(one[0] for one in of_probe)])
                    size = len(batch.probes[i])
                    combined = combined_scores(scores, sizes, batch.votes[i], size)
                    places = state.indices(segment, local)
                    order = np.lexsort((self.search.numbers[places], -combined))[:most]
                    chosen = np.sort(places[order])
                    batch.staged.append(Preselection(chosen, (len(local), len(chosen)), loss))
                    batch.segments[i], batch.local[i] = state.places(chosen)
                yield batch


def _vote(
    _: None, piece: IndexedPiece, chunk: tuple[Sequence[Any], int, float, float]
) -> list[tuple[Indices, NDArray[np.uint16]]]:
    """Return for each probe the prints of a segment that may be passed on, and their votes."""
    probes, most, budget, unoriented = chunk
    terms = [piece.segment.terms]
    chosen = [
        preselect(probe, terms, piece.removed, most, budget, unoriented=unoriented)
        for probe in probes
    ]
    return [(one.local, one.votes) for one in chosen]


def _score(
    _: None, piece: IndexedPiece, chunk: tuple[Sequence[Any], Sequence[Indices]]
) -> list[tuple[NDArray[np.int32], NDArray[np.uint16]]]:
    """Return for each probe the scores of the bit descriptors of prints of a segment, and sizes."""
    descriptors = piece.segment.descriptors
    return [
        (descriptors.scores(probe, local), descriptors.size[local])
        for probe, local in zip(*chunk, strict=True)
    ]


def _compare(
    _: None, piece: IndexedPiece, chunk: tuple[Sequence[Any], Sequence[Indices]]
) -> list[NDArray[np.float64]]:
    """Return for each probe the similarities to prints of a segment."""
    matcher: Any = piece.matcher
    similarities = []
    for probe, local in zip(*chunk, strict=True):
        packed = prepare_compact(piece.segment.templates, local)
        similarities.append(matcher.similarities(probe, packed) if len(local) else np.zeros(0))
    return similarities

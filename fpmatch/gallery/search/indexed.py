"""Search of a large gallery in four stages, by its index.

The terms of the index choose prints whose bit descriptors are compared; these choose the prints
whose ridges are compared in one place, and these the prints that are compared whole, by their
compact templates (see `fpmatch.gallery.index`). A first round of the stages finds clear mates. A
second one, which passes more prints on, follows only where it finds none (see
`fpmatch.gallery.index.loss`). The most similar prints are compared again by the templates in the
gallery, as a verification compares them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import inf
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.index.loss import chosen_by_ridges, combined_scores, search_rounds
from fpmatch.gallery.index.print_segment import (
    MOST_PRINTS,
    PrintSegment,
    prepare_prints,
    ridge_agreements,
)
from fpmatch.gallery.index.prints.compact_template import CompactTemplates, prepare_compact
from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.index.prints.descriptor_scores import PRINTS_AT_ONCE
from fpmatch.gallery.index.stages import most_voted, preselect, unoriented_share
from fpmatch.gallery.index.terms import probe_terms
from fpmatch.gallery.search.search import MOST_WHOLE, Search
from fpmatch.gallery.search.stages import Division, Listed, Stage, add_compared
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.calibration import load_calibration

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.gallery_index import GalleryIndex
    from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
    from fpmatch.gallery.index.state import IndexState
    from fpmatch.gallery.index.terms import ProbeTerms
    from fpmatch.gallery.search.search import SearchOptions
    from fpmatch.gallery.search.stages import Indices, Places
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

PREPARED_AT_ONCE: Final = 64  # prints that one thread prepares and compares before it takes others
MOST_SEGMENTS: Final = 32  # of a piece
SHARED_PIECES: Final = 32  # among which threads divide the segments, if there are enough


@dataclass(frozen=True, slots=True, eq=False)
class IndexedPiece:
    """Adjacent segments of an index, the number of the first, and which entries were removed."""

    first: int
    matcher: Matcher
    segments: Sequence[PrintSegment]
    removed: NDArray[np.int64]

    def located(self, local: Indices) -> tuple[Indices, Indices]:
        """Return the segments of some prints, by their places in the piece, and places in these."""
        starts = self.starts
        segment = np.searchsorted(starts, local, "right") - 1
        return segment, local - starts[segment]

    @property
    def starts(self) -> NDArray[np.int64]:
        """The place of the first print of each segment, and the number of all."""
        return np.cumsum([0, *map(len, self.segments)])


class IndexedSearch(Search):
    """The prints of a gallery by its index, whose segments are read at the first search.

    `prepare` makes the search of whole templates. The `state` of the index is that of the gallery
    now, unless it is given. `added` are packed templates of prints that are not in the gallery, by
    number.
    """

    in_stages = True

    def __init__(
        self,
        index: GalleryIndex,
        damaged: Mapping[int, str],
        prepare: Callable[[], Search],
        state: IndexState | None = None,
        added: Mapping[int, bytes] | None = None,
    ) -> None:
        self.matcher, self.damaged, self.index = index.matcher, damaged, index
        self._prepare, self._loaded, self._added = prepare, state, added or {}
        self._at_first = index.refresh() if state is None else state

    @property
    def state(self) -> IndexState:
        """The index, all of whose segments have been checked."""
        if self._loaded is None:
            self._loaded = self.index.loaded()
        return self._loaded

    def __len__(self) -> int:
        return len(self._at_first if self._loaded is None else self._loaded)

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The number of the entry of each print, ascending."""
        return self.state.numbers

    @cached_property
    def fingers(self) -> NDArray[np.int64]:
        """The lowest number of an entry of the finger of each print."""
        return self.state.fingers

    def division(self, of_threads: bool) -> Division:
        """Return the segments, several together; threads share more pieces than workers."""
        return self._shared if of_threads else self._sent

    @cached_property
    def _shared(self) -> Division:
        return self._divided(min(max(len(self.state.parts) // SHARED_PIECES, 1), MOST_SEGMENTS))

    @cached_property
    def _sent(self) -> Division:
        return self._divided(MOST_SEGMENTS)

    def _divided(self, at_once: int) -> Division:
        state, segments, pieces = self.state, self.state.segments, []
        for k in range(0, len(segments), at_once):
            some = segments[k : k + at_once]
            ends = some[0].numbers[0], some[-1].numbers[-1] + 1
            first, last = np.searchsorted(state.removed, ends)
            pieces.append(IndexedPiece(k, self.matcher, some, state.removed[first:last]))
        starts = np.cumsum([0, *map(len, segments)])

        def locate(places: Indices) -> tuple[Indices, Indices]:
            segment, place = state.places(places)
            piece = segment // at_once
            return piece, place + starts[segment] - starts[piece * at_once]

        return Division(pieces, [sum(map(len, one.segments)) for one in pieces], locate)

    def print_at(self, place: int) -> PreparedTemplate:
        """Return a print, prepared from the template of the gallery, or its compact one."""
        places = np.array([place])
        _, whole = self._whole_prints(places)
        return whole[0] if len(whole) else self._compact_prints(places)[0]

    def _compact_prints(self, places: Indices) -> PreparedPrints:
        """Return prints, prepared from their compact templates."""
        return prepare_prints(self.state.segments, *self.state.places(places))

    def _whole_prints(self, places: Indices) -> tuple[Indices, PreparedPrints]:
        """Return which of the prints are still in the gallery, and these, prepared from there."""
        numbers = self.numbers[places].tolist()
        packed = {**dict(self.index.gallery.packed_templates(of=numbers)), **self._added}
        there = np.array([k for k, number in enumerate(numbers) if number in packed], np.intp)
        templates = CompactTemplates.of_bytes(packed[numbers[k]] for k in there.tolist())
        return there, prepare_compact(templates, np.arange(len(there)))

    def can_be_sent(self) -> bool:
        """Return whether other processes can get the segments."""
        return True

    @cached_property
    def _whole(self) -> Search:
        return self._prepare()

    def for_loss(self, loss: float) -> Search:
        """Return the search that loses so many mates: this, or that of whole prints."""
        return self if loss else self._whole

    def current(self, gallery: GalleryReader) -> Search:
        """Return the search of the open gallery as it is now: this one, if it has not changed."""
        self.index.gallery = gallery
        now = self.index.refresh()
        if now is self._at_first or now is self._loaded:
            return self
        return IndexedSearch(self.index, gallery.damaged, self._prepare)

    def with_prints(self, templates: Sequence[Template]) -> IndexedSearch:
        """Return a search of some templates, too, as a gallery stores them; no file is changed."""
        state, last = self.state, int(self.numbers[-1]) if len(self) else 0
        added = dict(self._added)
        for first in range(0, len(templates), MOST_PRINTS):
            part = templates[first : first + MOST_PRINTS]
            packed = dict(enumerate(map(pack_template, part), start=last + 1))
            stored = {number: unpack_template(one) for number, one in packed.items()}
            rows = [
                (number, number, one, self.matcher.prepare(one)) for number, one in stored.items()
            ]
            last += len(rows)
            added |= packed
            state = state.with_part(PrintSegment.build(rows), last, ())
        return IndexedSearch(
            self.index, self.damaged, lambda: self._whole.with_prints(templates), state, added
        )

    def stages(self, options: SearchOptions) -> list[Stage]:
        """Return rounds of terms, bit descriptors, ridges and comparison, then other impressions.

        There is one round where all mates are looked for, or each impression is a candidate.
        """
        rounds = search_rounds(
            options.loss,
            len(self),
            options.least_compared,
            all_mates=options.all_mates or options.listed == "impressions",
        )
        unoriented = unoriented_share([one.terms for one in self.state.segments])
        calibration = options.calibration or load_calibration(self.matcher.name)
        stages: list[Stage] = []
        for plan, decisive in rounds:
            by_terms = max(plan.by_terms, options.count)
            by_descriptors = max(plan.by_descriptors, options.count)
            by_ridges = max(plan.by_ridges, options.count)
            terms_of = partial(probe_terms, budget=plan.budget, unoriented=unoriented)
            end = partial(_end_of_round, calibration, decisive)
            of_round = [
                Stage(partial(_votes, by_terms), partial(self._by_votes, by_terms), ask=terms_of),
                Stage(_descriptor_scores, partial(_by_descriptors, by_descriptors), PRINTS_AT_ONCE),
                Stage(
                    _ridge_agreement,
                    partial(_by_ridges, by_ridges),
                    PRINTS_AT_ONCE,
                    across=self._ridge_agreement_across,
                ),
                self.comparison()._replace(choose=end),
            ]
            if by_ridges >= by_descriptors:  # all are compared
                del of_round[2]
            stages += [stage._replace(of_round=True) for stage in of_round]
        others = partial(self._other_impressions, options.count)
        last = self.comparison()._replace(choose=self._with_whole)
        return [*stages, self.comparison()._replace(choose=others), last]

    def comparison(self) -> Stage:
        """Return the stage that compares the prints that are listed."""
        return Stage(
            _similarities, add_compared, PREPARED_AT_ONCE, across=self._similarities_across
        )

    def _similarities_across(self, _: Any, probe: Any, places: Indices) -> NDArray[np.float64]:
        """Return the similarities of a probe to prints, prepared together."""
        return similarities(self.matcher, probe, self._compact_prints(places))

    def _ridge_agreement_across(self, _: Any, probe: Any, places: Indices) -> NDArray[np.float64]:
        """Return the agreement of the ridges of a probe and of prints."""
        return ridge_agreements(probe, self.state.segments, *self.state.places(places))

    def _by_votes(
        self, most: int, _: Any, listed: Listed, voted: list[tuple[int, Indices, NDArray[Any]]]
    ) -> Listed:
        """List the prints with the most votes of all segments; of equals, the first."""
        segment = np.repeat([k for k, _, _ in voted], [len(local) for _, local, _ in voted])
        local = np.concatenate([np.empty(0, np.intp), *(local for _, local, _ in voted)])
        votes = np.concatenate([np.empty(0, np.uint16), *(votes for _, _, votes in voted)])
        kept = most_voted(votes, most)
        places = self.state.indices(segment.astype(np.intp)[kept], local[kept])
        return replace(listed, places=places, scores=votes[kept])

    def _other_impressions(self, count: int, _: Any, listed: Listed, __: Any) -> Listed:
        """List other impressions of the fingers that rank first."""
        best = listed.compared[listed.most_similar(count)]
        impressions = self.impressions_of(np.unique(self.finger_of[best]))
        return replace(listed, places=np.setdiff1d(impressions, listed.compared))

    def _with_whole(self, probe: Any, listed: Listed, parts: list[NDArray[np.float64]]) -> Listed:
        """Compare the most similar prints again, by the templates of the gallery."""
        listed = listed.with_compared(parts)
        best = listed.most_similar(MOST_WHOLE)
        similar = listed.similarities.copy()
        similar[best] = self.whole_similarities(probe, listed.compared[best], similar[best])
        return replace(listed, similarities=similar)

    def whole_similarities(
        self, probe: Any, which: Indices, known: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the similarities of a probe to a few prints by the templates in the gallery.

        A print that was removed from the gallery keeps its `known` similarity, by the compact
        template.
        """
        there, prints = self._whole_prints(which)
        similar = known.copy()
        similar[there] = similarities(self.matcher, probe, prints)
        return similar


def _end_of_round(
    calibration: Calibration,
    decisive: float,
    _: Any,
    listed: Listed,
    parts: list[NDArray[np.float64]],
) -> Listed:
    """End the search if a print is similar enough, or this is the last round; else list all."""
    listed = listed.with_compared(parts)
    best = float(listed.similarities.max(initial=0.0))
    if decisive == inf or calibration.score(best) >= decisive:
        return replace(listed, ended=True)
    return replace(listed, places=None)


def _votes(
    most: int, piece: IndexedPiece, terms: ProbeTerms, _: Places
) -> tuple[int, Indices, NDArray[np.uint16]]:
    """Return a piece's first segment, its prints with the most votes, and these."""
    segments = [one.terms for one in piece.segments]
    return piece.first, *preselect(segments, terms, most, piece.removed)


def _descriptor_scores(
    piece: IndexedPiece, probe: Any, local: Indices
) -> tuple[NDArray[np.int32], NDArray[np.uint16]]:
    """Return the scores of the bit descriptors of prints of a piece, ascending, and their sizes."""
    segment, place = piece.located(local)
    parts = [(piece.segments[k].descriptors, place[segment == k]) for k in np.unique(segment)]
    scores = [descriptors.scores(probe, some) for descriptors, some in parts]
    return np.concatenate(scores), np.concatenate([one.size[some] for one, some in parts])


def _by_descriptors(
    most: int, probe: Any, listed: Listed, parts: list[tuple[NDArray[Any], NDArray[Any]]]
) -> Listed:
    """List the prints with the most votes and bit descriptors in common; of equals, the first.

    Those that an earlier round compared are left out.
    """
    scores = np.concatenate([np.empty(0, np.int32), *(scores for scores, _ in parts)])
    sizes = np.concatenate([np.empty(0, np.int32), *(sizes for _, sizes in parts)])
    combined = combined_scores(scores, sizes, listed.scores, len(probe))
    kept = np.sort(np.argsort(-combined, kind="stable")[:most])
    assert listed.places is not None
    passed_on = len(listed.places), len(kept), len(kept)
    kept = kept[~np.isin(listed.places[kept], listed.compared)]
    return replace(listed, places=listed.places[kept], scores=combined[kept], passed_on=passed_on)


def _ridge_agreement(piece: IndexedPiece, probe: Any, local: Indices) -> NDArray[np.float64]:
    """Return the agreement of the ridges of a probe and of prints of a piece."""
    return ridge_agreements(probe, piece.segments, *piece.located(local))


def _by_ridges(most: int, _: Any, listed: Listed, parts: list[NDArray[np.float64]]) -> Listed:
    """List the prints of `chosen_by_ridges`."""
    agreement = np.concatenate([np.empty(0), *parts])
    kept = chosen_by_ridges(listed.scores, agreement, most)
    assert listed.places is not None
    passed_on = *listed.passed_on[:2], len(kept)
    return replace(listed, places=listed.places[kept], passed_on=passed_on)


def _similarities(piece: IndexedPiece, probe: Any, local: Indices) -> NDArray[np.float64]:
    """Return the similarities of a probe to prints of a piece."""
    return similarities(piece.matcher, probe, prepare_prints(piece.segments, *piece.located(local)))

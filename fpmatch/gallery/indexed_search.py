"""Search of a large gallery in three stages, by its index.

The terms of the index choose prints whose bit descriptors are compared; these choose the prints
that are compared whole, by their compact templates (see `fpmatch.gallery.index`).
"""

from __future__ import annotations

from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.index.gallery_index import GalleryIndex
from fpmatch.gallery.index.loss import combined_scores, search_plan
from fpmatch.gallery.index.print_segment import MOST_PRINTS, PrintSegment, prepare_prints
from fpmatch.gallery.index.stages import preselect
from fpmatch.gallery.prepared_search import Preselection, Search, parts_of
from fpmatch.matching.prints.candidate_list import PRINTS_AT_ONCE
from fpmatch.templates.stored_template import pack_template, unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.state import IndexState
    from fpmatch.gallery.prepared_search import Each
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.prints.prepare import PreparedTemplate
    from fpmatch.matching.prints.prepared_prints import PreparedPrints
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

PREPARED_AT_ONCE: Final = 64  # prints that one thread prepares and compares before it takes others


class IndexedPrints:
    """The prints of an index, prepared from their compact templates when they are compared."""

    def __init__(self, state: IndexState) -> None:
        self._state = state

    def __len__(self) -> int:
        return len(self._state)

    def __getitem__(self, k: int) -> PreparedTemplate:
        """Return print k, prepared."""
        return self.take(np.array([k]))[0]

    def take(self, which: NDArray[np.integer]) -> PreparedPrints:
        """Return some prints, packed."""
        return prepare_prints(self._state.segments, *self._state.places(which))


class IndexedSearch(Search):
    """The prints of a gallery by its index, whose segments are read at the first search."""

    def __init__(
        self, index: GalleryIndex, damaged: Mapping[int, str], prepare: Callable[[], Search]
    ) -> None:
        self.__dict__.update(matcher=index.matcher, damaged=damaged, index=index, _prepare=prepare)
        self.__dict__["_at_first"] = index.refresh()

    index: GalleryIndex
    _prepare: Callable[[], Search]
    _at_first: IndexState

    @cached_property
    def state(self) -> IndexState:
        """The index, all of whose segments have been checked."""
        return self.index.loaded()

    def __len__(self) -> int:
        return len(self.__dict__.get("state", self._at_first))

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The number of the entry of each print."""
        return self.state.numbers

    @cached_property
    def fingers(self) -> NDArray[np.int64]:
        """The lowest number of an entry of the finger of each print."""
        return self.state.fingers

    @cached_property
    def references(self) -> IndexedPrints:  # type: ignore[override]
        """The prepared prints."""
        return IndexedPrints(self.state)

    @cached_property
    def whole(self) -> Search:
        """The search of the prints that are prepared from their whole templates."""
        return self._prepare()

    def current(self, gallery: GalleryReader) -> Search:
        """Return the search of the open gallery as it is now: this one, if it has not changed."""
        self.index.gallery = gallery
        now = self.index.refresh()
        if now is self._at_first or now is self.__dict__.get("state"):
            return self
        return IndexedSearch(self.index, gallery.damaged, self._prepare)

    def with_prints(self, templates: Sequence[Template]) -> IndexedSearch:
        """Return a search of some templates, too, as `Search.with_prints`; no file is changed."""
        state, last = self.state, int(self.numbers[-1]) if len(self) else 0
        for first in range(0, len(templates), MOST_PRINTS):
            part = templates[first : first + MOST_PRINTS]
            stored = [unpack_template(pack_template(one)) for one in part]
            rows = [
                (number, number, one, self.matcher.prepare(one))
                for number, one in enumerate(stored, start=last + 1)
            ]
            last += len(rows)
            state = state.with_part(PrintSegment.build(rows), last, ())
        joined = IndexedSearch.__new__(IndexedSearch)
        kept = {name: self.__dict__[name] for name in ("matcher", "damaged", "index")}
        joined.__dict__.update(kept, state=state, _at_first=state)
        joined.__dict__["_prepare"] = lambda: self.whole.with_prints(templates)
        return joined

    def similarities(
        self, probe: Any, which: NDArray[np.intp] | None = None, each: Each = map
    ) -> NDArray[np.float64]:
        """Return the similarity of a prepared probe to each print, or to those of `which`."""
        matcher: Any = self.matcher
        wanted = np.arange(len(self)) if which is None else which
        parts = parts_of(wanted, PREPARED_AT_ONCE)
        compared = each(lambda part: matcher.similarities(probe, self.references.take(part)), parts)
        return np.concatenate([np.zeros(0), *compared])

    def preselect(
        self,
        probe: PreparedTemplate,
        loss: float,
        count: int,
        threshold: float = 0.0,
        each: Each = map,
    ) -> Preselection:
        """Return the prints to compare with a probe: those the index and the descriptors choose."""
        state, segments = self.state, self.state.segments
        plan = search_plan(loss, len(self), threshold)
        terms = [segment.terms for segment in segments]
        by_terms = max(plan.by_terms, count)
        chosen = preselect(probe, terms, state.removed, by_terms, plan.budget, each)
        scores, sizes = np.empty((2, len(chosen)), np.int32)
        number = np.empty(len(chosen), np.int64)

        def score(part: NDArray[np.intp]) -> None:
            segment, local = segments[chosen.segment[part[0]]], chosen.local[part]
            scores[part] = segment.descriptors.scores(probe, local)
            sizes[part] = segment.descriptors.size[local]
            number[part] = segment.numbers[local]

        of_each = (np.flatnonzero(chosen.segment == k) for k in range(len(segments)))
        list(each(score, [part for of in of_each for part in parts_of(of, PRINTS_AT_ONCE)]))
        combined = combined_scores(scores, sizes, chosen.votes, len(probe))
        order = np.lexsort((number, -combined))[: max(plan.by_descriptors, count)]
        places = np.sort(state.indices(chosen.segment[order], chosen.local[order]))
        return Preselection(places, (len(chosen), len(places)), loss)

    def further_impressions(
        self, places: NDArray[np.intp], similarities: NDArray[np.float64], count: int
    ) -> NDArray[np.intp]:
        """Return the places of other impressions of the fingers that rank first."""
        best = places[np.argsort(-similarities, kind="stable")[:count]]
        (order, starts), sizes = self._by_finger, self.finger_sizes
        fingers = np.unique(self.finger_of[best]).tolist()
        impressions = [order[starts[f] : starts[f] + sizes[f]] for f in fingers]
        return np.setdiff1d(np.concatenate([np.empty(0, np.intp), *impressions]), places)


def indexed_search(
    gallery: GalleryReader,
    matcher: Matcher,
    before: Search | None,
    prepare: Callable[..., Search],
    **given: Any,
) -> Search:
    """Return the search of an open gallery by its index, that of a search `before` if it has one.

    `prepare` makes the search of whole templates; it and `GalleryIndex` take what is `given`.
    """
    if isinstance(before, IndexedSearch):
        return before.current(gallery)
    index = GalleryIndex(gallery, matcher, **given)
    return IndexedSearch(index, gallery.damaged, partial(prepare, **given))

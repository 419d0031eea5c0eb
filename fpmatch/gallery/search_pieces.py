"""Searches for many probes on all cores or machines: each worker holds prints of the gallery.

The prints of a `Search` are divided into ranges, the pieces, which workers hold (see
`fpmatch.engine.pieces`). A probe is sent to all of them. Their results are put together before it
is decided which prints are compared, and which fingers are candidates. So the candidates are the
same as in a search in one process, to the last bit.
"""

from __future__ import annotations

import pickle
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.engine.engine import serial
from fpmatch.engine.pieces import hold_pieces, map_to_all
from fpmatch.gallery.identify import candidate_list_size
from fpmatch.gallery.prepared_search import Search
from fpmatch.indexing.loss import DEFAULT_LOSS
from fpmatch.matching.prints.candidate_list import greatest, prefilter_scores
from fpmatch.matching.prints.prepared_prints import PreparedPrints

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.engine.pieces import Pieces
    from fpmatch.gallery.indexed_pieces import HeldIndexedSearch
    from fpmatch.gallery.prepared_search import CandidateListSize, Each
    from fpmatch.templates.minutiae import Template

MIN_PIECE: Final = 512  # prints of a piece; fewer take less time than it takes to send probes
MAX_PIECE: Final = 4096
LEAST_PIECES: Final = 16  # into which a smaller gallery is divided
MAX_BATCH: Final = 16  # probes that are searched for together
COMPARISONS_PER_TASK: Final = 20_000  # of a batch with a piece, about


class Answer(NamedTuple):
    """The prints that were compared with a probe (None: all), and their similarities to it."""

    which: NDArray[np.intp] | None
    similarities: NDArray[np.float64]


NO_ANSWER: Final = Answer(None, np.zeros(0))


@dataclass(frozen=True, eq=False)
class AnsweredSearch(Search):
    """A search for one probe, whose comparisons have been made."""

    answer: Answer = NO_ANSWER

    def candidate_list(self, probe: Any, count: int, each: Each = map) -> NDArray[np.intp]:
        """Return the prints that were compared with the probe."""
        return np.arange(len(self)) if self.answer.which is None else self.answer.which

    def similarities(
        self, probe: Any, which: NDArray[np.intp] | None = None, each: Each = map
    ) -> NDArray[np.float64]:
        """Return their similarities."""
        return self.answer.similarities


@dataclass(frozen=True, slots=True, eq=False)
class SearchPiece:
    """The prints of a search from number `first` on."""

    first: int
    prints: Search


def divide(search: Search) -> list[SearchPiece]:
    """Return the pieces of a search, which are mostly in the same memory."""
    return [_piece(search, first, last) for first, last in spans(len(search))]


def spans(prints: int) -> list[tuple[int, int]]:
    """Return where the pieces of so many prints begin and end.

    Examples
    --------
    >>> spans(600), len(spans(20_000)), len(spans(1_000_000))
    ([(0, 512), (512, 600)], 16, 245)
    """
    size = piece_size(prints)
    return [(first, min(first + size, prints)) for first in range(0, prints, size)]


def batch_size(prints: int, *, staged: bool = False) -> int:
    """Return how many probes are searched for together among so many prints.

    Examples
    --------
    >>> batch_size(16), batch_size(1_000_000), batch_size(1_000_000, staged=True)
    (16, 4, 16)
    """
    if staged:
        return MAX_BATCH
    return min(MAX_BATCH, max(1, COMPARISONS_PER_TASK // piece_size(prints)))


def piece_size(prints: int) -> int:
    """Return the number of prints of a piece of so many."""
    return max(MIN_PIECE, min(MAX_PIECE, -(-prints // LEAST_PIECES)))


def _piece(search: Search, first: int, last: int) -> SearchPiece:
    references = search.references
    if isinstance(references, PreparedPrints):
        part: Any = references.part(first, last)
    else:
        part = references[first:last]
    numbers, fingers = search.numbers[first:last], search.fingers[first:last]
    return SearchPiece(first, Search(search.matcher, numbers, fingers, part))


@contextmanager
def hold_search(
    engine: Engine, search: Search, candidate_list: CandidateListSize = "auto"
) -> Iterator[HeldSearch | HeldIndexedSearch]:
    """Let the workers of an engine, which is entered, hold the prints of a search.

    `candidate_list` is that of the searches that follow. Where the matcher's prints cannot be sent
    to other processes, this one holds them.
    """
    if searched_in_stages(search, candidate_list):
        from fpmatch.gallery.indexed_pieces import (  # noqa: PLC0415  (imports the index)
            HeldIndexedSearch,
            divide_index,
        )

        indexed: Any = search
        with hold_pieces(engine, divide_index(indexed)) as segments:
            yield HeldIndexedSearch(indexed, segments)
        return
    whole = search.whole
    near = engine if _can_be_sent(whole) else serial()
    with near, hold_pieces(near, divide(whole)) as held:
        yield HeldSearch(whole, held)


def _can_be_sent(search: Search) -> bool:
    """Return whether other processes can get prepared prints; of some matchers they cannot."""
    if isinstance(search.references, PreparedPrints):
        return True
    try:
        pickle.dumps((search.matcher, list(search.references[:1])))
    except (AttributeError, TypeError, pickle.PicklingError):
        return False
    return True


def searched_in_stages(search: Search, candidate_list: CandidateListSize) -> bool:
    """Return whether `identify` searches in stages, by the index of a large gallery."""
    return candidate_list == "auto" and type(search).preselect is not Search.preselect


class HeldSearch:
    """Search with the workers of an engine, which hold the prints."""

    def __init__(self, search: Search, held: Pieces[SearchPiece]) -> None:
        self.search, self._held = search, held
        self._spans = spans(len(search))

    def answers(
        self,
        batches: Iterable[Sequence[Any]],
        *,
        count: int = 10,
        candidate_list: CandidateListSize = "auto",
        loss: float = DEFAULT_LOSS,
        threshold: float = 0.0,
    ) -> Generator[list[Answer], None, None]:
        """Yield what each probe of each batch, prepared by the matcher, is answered.

        `count`, `candidate_list`, `loss` and `threshold` are those of
        `fpmatch.gallery.identify.identify`. Batches are drawn as they are needed. Raises
        EngineError if the engine broke down.
        """
        size = candidate_list_size(self.search, candidate_list)
        most = None if size is None else max(size, count)
        with closing(self._chosen(batches, most)) as chosen:
            yield from self._compared(chosen)

    def answered(self, answer: Any) -> Search:
        """Return the search with which `identify` finds the candidates of an answered probe."""
        s = self.search
        made = AnsweredSearch(s.matcher, s.numbers, s.fingers, s.references, s.damaged, answer)
        made.__dict__.update({"_by_finger": s._by_finger, "_grouped": s._grouped})  # computed once
        return made

    def _chosen(
        self, batches: Iterable[Sequence[Any]], most: int | None
    ) -> Generator[tuple[Sequence[Any], list[NDArray[np.intp] | None]], None, None]:
        """Yield batches with the prints to compare with each probe; None for all."""
        if most is None or most >= len(self.search):
            for batch in batches:
                every = None if most is None else np.arange(len(self.search))
                yield batch, [every] * len(batch)
            return
        references: Any = self.search.references
        sizes = np.diff(references.minutiae_start)
        total = len(self._spans)
        rounds = map_to_all(self._held, total, _preselect, batches, lambda batch, _: batch)
        with closing(rounds) as scored:
            for batch, parts in scored:
                scores = map(np.concatenate, by_probe(parts, len(batch)))
                yield (
                    batch,
                    [
                        greatest(of_probe, sizes, probe, most)
                        for probe, of_probe in zip(batch, scores, strict=True)
                    ],
                )

    def _compared(
        self, chosen: Iterable[tuple[Sequence[Any], list[NDArray[np.intp] | None]]]
    ) -> Generator[list[Answer], None, None]:
        def within(batch: tuple[Sequence[Any], list[Any]], k: int) -> tuple[Sequence[Any], Any]:
            probes, which = batch
            return probes, [_within(one, self._spans[k]) for one in which]

        rounds = map_to_all(self._held, len(self._spans), _compare, chosen, within)
        with closing(rounds) as compared:
            for (probes, which), parts in compared:
                similarities = by_probe(parts, len(probes))
                yield [
                    Answer(one, np.concatenate([np.zeros(0), *shares]))
                    for one, shares in zip(which, similarities, strict=True)
                ]


def by_probe(parts: Sequence[Sequence[Any]], probes: int) -> list[list[Any]]:
    """Return for each probe what all pieces returned."""
    return [[part[i] for part in parts] for i in range(probes)]


def answered_searches(
    engine: Engine,
    search: Search,
    probes: Sequence[Template],
    *,
    count: int,
    candidate_list: CandidateListSize,
    loss: float,
) -> list[Search]:
    """Return a search for each of a few probes, answered by the workers of an engine."""
    prepared = [search.matcher.prepare(probe) for probe in probes]
    limits: dict[str, Any] = {"count": count, "candidate_list": candidate_list, "loss": loss}
    with (
        engine,
        hold_search(engine, search, candidate_list) as held,
        closing(held.answers([prepared], **limits)) as answers,
    ):
        (answered,) = answers  # of one batch
        return [held.answered(one) for one in answered]


def _within(which: NDArray[np.intp] | None, span: tuple[int, int]) -> NDArray[np.intp] | None:
    """Return those of ascending indices that are in a piece, counted from its first print."""
    if which is None:
        return None
    first, last = np.searchsorted(which, span)
    return which[first:last] - span[0]


def _preselect(_: None, piece: SearchPiece, probes: Sequence[Any]) -> list[NDArray[np.uint16]]:
    """Return for each probe the scores of the bit descriptors of a piece's prints."""
    references = piece.prints.references
    assert isinstance(references, PreparedPrints)
    return [prefilter_scores(probe, references).astype(np.uint16) for probe in probes]


def _compare(
    _: None, piece: SearchPiece, chunk: tuple[Sequence[Any], Sequence[NDArray[np.intp] | None]]
) -> list[NDArray[np.float64]]:
    """Return for each probe the similarities to prints of a piece."""
    return [
        np.zeros(0) if which is not None and not len(which) else piece.prints.similarities(p, which)
        for p, which in zip(*chunk, strict=True)
    ]

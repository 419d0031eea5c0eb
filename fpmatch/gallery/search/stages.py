"""The stages of a search: each scores prints of every piece, then chooses by the scores of all.

The prints of a search lie in pieces. A piece is scored by a thread of this process, by a worker
process, or by a worker of a cluster, through the same call:
`fpmatch.gallery.engine.pieces.hold_pieces`. So the prints that are compared, and their
similarities, are the same to the last bit.
"""

from __future__ import annotations

from collections import defaultdict
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.engine.pieces import hold_pieces, map_batches

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.pieces import Pieces

    Indices = NDArray[np.intp]
    Places = slice | Indices

LEAST_PIECES: Final = 4  # fewer are held by several workers of a cluster
NO_PLACES: Final = np.empty(0, np.intp)


@dataclass(frozen=True, slots=True, eq=False)
class Listed:
    """What the stages have found for a probe so far.

    `places` are the prints that the next stage scores, ascending (None: all), and `scores` the ones
    by which the last stage listed them. `passed_on` is how many prints each stage passed on;
    `ended` states that no further round of stages is needed.
    """

    places: Indices | None = None
    scores: NDArray[Any] = field(default_factory=lambda: np.empty(0))
    compared: Indices = field(default_factory=lambda: NO_PLACES)
    similarities: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    passed_on: tuple[int, ...] = ()
    ended: bool = False

    def most_similar(self, count: int) -> Indices:
        """Return which of the `compared` prints are most similar, best first; of equals, the first.

        Others than the best `count` are left out.
        """
        return np.argsort(-self.similarities, kind="stable")[:count]

    def with_compared(self, parts: Sequence[NDArray[np.float64]]) -> Listed:
        """Return the prints with the similarities of the `places`, part by part."""
        new = np.concatenate([np.empty(0), *parts])
        places = np.arange(len(new)) if self.places is None else self.places
        compared = np.concatenate([self.compared, places])
        similarities = np.concatenate([self.similarities, new])
        order = np.argsort(compared)
        return replace(
            self, places=NO_PLACES, compared=compared[order], similarities=similarities[order]
        )


def add_compared(_: Any, listed: Listed, parts: list[NDArray[np.float64]]) -> Listed:
    """Return what a comparison makes of the prints that are listed, for `Stage.choose`."""
    return listed.with_compared(parts)


class Stage(NamedTuple):
    """One stage of a search.

    ``score(piece, asked, places)`` returns the result for prints of a piece, given their places in
    it: of a function at the top of a module, with what `ask` makes of the probe. Threads call
    `across` alike instead, if there is one, with places among all pieces. ``choose(probe,
    listed, results)`` gets the results of all pieces, in order. A thread takes `at_once` prints
    before it takes others (None: a piece). A probe whose rounds have ended skips stages `of_round`.
    """

    score: Callable[[Any, Any, Any], Any]
    choose: Callable[[Any, Listed, list[Any]], Listed]
    at_once: int | None = None
    ask: Callable[[Any], Any] = lambda probe: probe
    of_round: bool = False
    across: Callable[[Any, Any, Any], Any] | None = None


class Division(NamedTuple):
    """Prints in pieces of some sizes.

    ``locate(places)`` returns for prints, ascending, the numbers of their pieces, and their places
    in these.
    """

    pieces: Sequence[Any]
    sizes: Sequence[int]
    locate: Callable[[Indices], tuple[Indices, Indices]]


def run_stages(
    division: Callable[[bool], Division],
    stages: Sequence[Stage],
    batches: Iterable[Sequence[Any]],
    engine: Engine,
    listed: Listed | None = None,
) -> Generator[list[Listed], None, None]:
    """Yield what all stages find for each probe of each batch, prepared by the matcher.

    `division` states how prints are divided among threads, or else among workers; `engine` is
    entered. Batches are drawn as they are needed, by threads all at once. The first stage begins
    with what is `listed`. Raises EngineError if the engine broke down.
    """
    begin = listed or Listed()
    apart = isinstance(engine, Threads)
    divided = division(apart)
    copies = 1 if apart or not divided.pieces else -(-LEAST_PIECES // len(divided.pieces))
    with hold_pieces(engine, [*divided.pieces] * copies) as held:
        rounds: Any = ([(probe, begin) for probe in batch] for batch in batches)
        for stage in stages:
            rounds = _round(divided, stage, rounds, held, copies, apart=apart)
        with closing(rounds):
            yield from ([after for _, after in batch] for batch in rounds)


_Batch = list[tuple[Any, Listed]]  # probes


def _round(
    divided: Division,
    stage: Stage,
    batches: Generator[_Batch, None, None],
    held: Pieces[Any],
    copies: int,
    *,
    apart: bool,
) -> Generator[_Batch, None, None]:
    """Yield batches after a stage. They take turns on the `copies` of the pieces."""
    turns = count()
    score = (stage.across if apart else None) or stage.score

    def tasks_of(batch: _Batch) -> list[tuple[int, list[Any]]]:
        first = next(turns) % copies * len(divided.pieces)
        tasks = _tasks(divided, stage, batch, apart=apart)
        made = [(first + piece, chunk) for piece, chunk in tasks]
        # without any, a batch would wait for a later one that has some
        return made or ([(first, [])] if divided.pieces else [])

    with (
        closing(batches),
        closing(map_batches(held, _score, score, batches, tasks_of)) as scored,
    ):
        for batch, results in scored:
            of_probe: list[list[Any]] = [[] for _ in batch]
            for result in results:
                for i, one in result:
                    of_probe[i].append(one)
            yield [
                (probe, _chosen(stage, probe, before, parts))
                for (probe, before), parts in zip(batch, of_probe, strict=True)
            ]


def _chosen(stage: Stage, probe: Any, before: Listed, parts: list[Any]) -> Listed:
    return before if stage.of_round and before.ended else stage.choose(probe, before, parts)


def _tasks(
    divided: Division, stage: Stage, batch: _Batch, *, apart: bool
) -> Iterator[tuple[int, list[Any]]]:
    """Yield pieces with probes, by number, and what is scored: `apart`, or all of a piece at once.

    Threads share probes, so that there are as many tasks as it takes to occupy all; to workers, a
    probe is sent once for a piece.
    """
    by_piece = defaultdict(list)
    for i, (probe, listed) in enumerate(batch):
        if listed.places is not None and not len(listed.places):
            continue
        asked = stage.ask(probe)
        if apart and stage.across:
            every = np.arange(sum(divided.sizes)) if listed.places is None else listed.places
            yield from ((0, [(i, asked, part)]) for part in _parts(every, stage.at_once))
            continue
        for piece, places in _within_pieces(divided, listed.places):
            if not apart:
                by_piece[piece].append((i, asked, places))
                continue
            for part in _parts(places, stage.at_once):
                yield piece, [(i, asked, part)]
    yield from sorted(by_piece.items())


def _within_pieces(divided: Division, places: Indices | None) -> Iterator[tuple[int, Places]]:
    """Yield the pieces that have some of the prints, with the places of these in them."""
    if places is None:
        yield from ((k, slice(0, size)) for k, size in enumerate(divided.sizes) if size)
        return
    piece, local = divided.locate(places)
    bounds = np.searchsorted(piece, np.arange(len(divided.pieces) + 1)).tolist()
    for k in np.unique(piece).tolist():
        yield k, local[bounds[k] : bounds[k + 1]]


def _parts(places: Places, at_once: int | None) -> Iterator[Places]:
    """Yield so many of the places at once; None: all."""
    if at_once is None:
        yield places
    elif isinstance(places, slice):
        for first in range(places.start, places.stop, at_once):
            yield slice(first, min(first + at_once, places.stop))
    else:
        yield from (places[first : first + at_once] for first in range(0, len(places), at_once))


def _score(score: Callable[..., Any], piece: Any, chunk: list[Any]) -> list[tuple[int, Any]]:
    """Return for each probe, by number, the result of a stage for prints of a piece."""
    return [(i, score(piece, asked, places)) for i, asked, places in chunk]

"""Batches on an engine: one attempt at each item, and how far they have come."""

from __future__ import annotations

from collections import deque
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeVar

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator

    from fpmatch.gallery.engine.engine import Engine

Item = TypeVar("Item")
Result = TypeVar("Result")

ITEMS_PER_CHUNK: Final = 2


class Progress(Protocol):
    """Receives how far a stage of a batch has come."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Note that `done` of `total` items of `stage` are finished."""


def no_progress(stage: str, done: int, total: int) -> None:
    """Ignore progress."""


@dataclass(frozen=True, slots=True)
class Attempt(Generic[Result]):
    """The result of the work on one item.

    `result` is None if the work raised an `FpmatchError`, whose message is then the `reason`.
    """

    result: Result | None
    reason: str


def attempt_each(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item]
) -> Generator[tuple[Item, Attempt[Result]], None, None]:
    """Yield each item with what the work on it gave; an item that is refused stops nothing.

    `work` is a function at the top of a module, or a `functools.partial` of one, called as
    ``work(item)``. Items are drawn as they are needed, and sent to a worker a few at a time.

    Examples
    --------
    >>> from fpmatch.gallery.engine.engine import serial
    >>> [attempt.result for _, attempt in attempt_each(serial(), abs, [-1, 2, -3])]
    [1, 2, 3]
    """
    iterator, sent = iter(items), deque[list[Item]]()

    def chunks() -> Iterator[list[Item]]:
        while chunk := list(islice(iterator, ITEMS_PER_CHUNK)):
            sent.append(chunk)
            yield chunk

    with closing(engine.map(_attempt_chunk, work, chunks(), _names)) as results:
        for attempts in results:
            yield from zip(sent.popleft(), attempts, strict=True)


def results_of_each(
    engine: Engine, work: Callable[[Item], Result], items: Iterable[Item]
) -> Iterator[Result | None]:
    """Yield ``work(item)`` for each item, as `map` does, None for items that are refused."""
    return (attempt.result for _, attempt in attempt_each(engine, work, items))


def _names(items: list[Any]) -> str:
    """Return the names of items that are prints, or begin with one."""
    prints = [item[0] if isinstance(item, tuple) else item for item in items]
    return ", ".join(str(getattr(one, "path", one)) for one in prints)


def _attempt_chunk(work: Callable[[Item], Result], chunk: list[Item]) -> list[Attempt[Result]]:
    attempts: list[Attempt[Result]] = []
    for item in chunk:
        try:
            attempts.append(Attempt(work(item), ""))
        except FpmatchError as error:
            attempts.append(Attempt(None, str(error)))
    return attempts

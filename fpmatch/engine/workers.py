"""Do a list of chunks of work on all cores, and tell how far it has come."""

from __future__ import annotations

from contextlib import closing, nullcontext
from typing import TYPE_CHECKING, Protocol, TypeVar

from fpmatch.engine.engine import cores
from fpmatch.engine.local import available_cores

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fpmatch.engine.engine import Engine

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Progress(Protocol):
    """Be told how far a stage of an evaluation has come."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Take note that `done` of `total` items of `stage` are finished."""


def no_progress(stage: str, done: int, total: int) -> None:
    """Take no note."""


def run_chunks(
    work: Callable[[Shared, Chunk], Result],
    shared: Shared,
    chunks: Sequence[Chunk],
    *,
    workers: int | None = None,
    engine: Engine | None = None,
    finished: Callable[[Chunk], None] = lambda _: None,
) -> list[Result]:
    """Return ``[work(shared, chunk) for chunk in chunks]``, computed by several processes.

    Parameters
    ----------
    work : callable
        A function at the top of a module, called as ``work(shared, chunk)``.
    shared : object
        What all chunks need; as `fpmatch.engine.engine.Engine.map` has it.
    chunks : sequence
        The pieces of work.
    workers : int, optional
        How many processes (default: one a core); 1 works in this process.
    engine : Engine, optional
        An engine that somebody has taken hold of, to work there instead.
    finished : callable
        Called with each chunk, in order, once its result is there.

    Returns
    -------
    list
        The results in the order of `chunks`.

    Raises
    ------
    ValueError
        If `workers` is less than 1.
    EngineError
        If a worker process ended before its work was done.
    """
    count = available_cores() if workers is None else workers
    results = []
    with (
        cores(min(count, max(1, len(chunks)))) if engine is None else nullcontext(engine) as place,
        closing(place.map(work, shared, chunks)) as stream,
    ):
        for result, chunk in zip(stream, chunks, strict=True):
            results.append(result)
            finished(chunk)
    return results

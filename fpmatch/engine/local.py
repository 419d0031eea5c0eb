"""The engines of this machine: this process, and several beside it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, TypeVar

from fpmatch.engine.ahead import fork_ahead
from fpmatch.engine.processes import Task, end
from fpmatch.engine.team import Team
from fpmatch.engine.threads import single_threaded

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from types import TracebackType
    from typing import Self

    from fpmatch.engine.processes import Worker

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def get_ready(workers: int | None, *modules: str) -> None:
    """Start the workers, and let them import what they will need, beside what is done meanwhile.

    It is for the first steps of a program, not for libraries: workers are forked here, which needs
    a process without other threads. Elsewhere than on Linux, and where there are other threads,
    nothing is done.

    Parameters
    ----------
    workers : int or None
        Processes that will be used (None: one a core); for one nothing is done.
    *modules : str
        Names of modules.
    """
    count = available_cores() if workers is None else workers
    if count > 1:
        fork_ahead(count, modules)


class Here:
    """Work in this process; see `fpmatch.engine.engine.Engine`."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
    ) -> Generator[Result, None, None]:
        """Work on one chunk after the other, each when its result is asked for."""
        with single_threaded():
            for chunk in chunks:
                yield work(shared, chunk)


class Cores:
    """Work in several processes; see `fpmatch.engine.engine.Engine`.

    They start with the first work, and go on to the next; where nobody has taken hold of the
    engine, they end with the work.

    Parameters
    ----------
    workers : int
        How many.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._held = False
        self._idle: list[Worker] = []

    def __enter__(self) -> Self:
        self._held = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._held = False
        idle, self._idle = self._idle, []
        end(idle)

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
    ) -> Generator[Result, None, None]:
        """Hand out chunks a few at a time, and their results in order."""
        team = Team(self._workers, self._idle, Task(work, shared))
        try:
            yield from team.results(chunks)
            if self._held:
                self._idle += team.release()
        finally:
            end(team.release())

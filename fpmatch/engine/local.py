"""The engines of this machine: this process, and several beside it."""

from __future__ import annotations

import multiprocessing
import os
import signal
from typing import TYPE_CHECKING, Final, TypeVar

from fpmatch.engine.processes import START_METHOD, Task, Team, end
from fpmatch.engine.threads import loaded_single_threaded, single_threaded

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from types import TracebackType
    from typing import Self

    from fpmatch.engine.processes import Worker

_NEEDED: Final = ("fpmatch.engine._fork_server", "fpmatch.engine.processes", "threadpoolctl")

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def get_ready(workers: int | None, *modules: str) -> None:
    """Let modules that workers will need be imported beside what this process does meanwhile.

    It is for a program's main thread, not for libraries: the process that workers are forked from
    is made once in the life of a program. Where they are not forked, nothing is done.

    Parameters
    ----------
    workers : int or None
        Processes that will be used (None: one a core); for one nothing is done.
    *modules : str
        Names of modules.
    """
    if START_METHOD != "forkserver" or (workers or available_cores()) == 1:
        return
    from multiprocessing import forkserver  # noqa: PLC0415

    multiprocessing.get_context(START_METHOD).set_forkserver_preload([*_NEEDED, *modules])
    on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # so it starts, and stays silent
    try:
        with loaded_single_threaded():  # no threads where processes are forked from
            forkserver.ensure_running()
    finally:
        signal.signal(signal.SIGINT, on_interrupt)


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

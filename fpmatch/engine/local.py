"""The engines of this machine: this process, and several beside it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch.engine.task import init_worker, told, work_on
from fpmatch.engine.threads import loaded_single_threaded, single_threaded
from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from concurrent.futures import Future, ProcessPoolExecutor
    from types import TracebackType
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

# A fork server forks each worker from a process that has imported what it needs and run nothing.
_START_METHOD: Final = "forkserver" if sys.platform == "linux" else "spawn"
CHUNKS_IN_FLIGHT: Final = 4  # a worker: what it works on, and what waits for it or to be taken
_EVERY_WORKER_NEEDS: Final = (
    "fpmatch.engine._fork_server",
    "fpmatch.engine.task",
    "concurrent.futures.process",
    "multiprocessing.synchronize",
)
_BROKEN: Final = (
    "a worker process ended before its work was done: out of memory, or started by a script "
    'without `if __name__ == "__main__":`; one worker needs neither'
)


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
    if _START_METHOD != "forkserver" or (workers or available_cores()) == 1:
        return
    from multiprocessing import forkserver  # noqa: PLC0415

    context = multiprocessing.get_context(_START_METHOD)
    context.set_forkserver_preload([*_EVERY_WORKER_NEEDS, *modules])
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

    Parameters
    ----------
    workers : int
        How many.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._held = False
        self._executor: ProcessPoolExecutor | None = None

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
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(cancel_futures=True)

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
    ) -> Generator[Result, None, None]:
        """Hand out chunks a few at a time, and their results in order."""
        from concurrent.futures.process import BrokenProcessPool  # noqa: PLC0415  (as in `_start`)

        executor = self._executor or _start(self._workers)
        if self._held:
            self._executor = executor
        waiting: deque[Future[Any]] = deque()
        try:
            with told(work, shared) as task:
                for chunk in chunks:
                    with _interrupted_later():  # for this may start a worker
                        waiting.append(executor.submit(work_on, task, chunk))
                    if len(waiting) >= CHUNKS_IN_FLIGHT * self._workers:
                        yield waiting.popleft().result()
                while waiting:
                    yield waiting.popleft().result()
        except BrokenProcessPool as error:
            if self._executor is executor:
                self._executor = None
            raise EngineError(_BROKEN) from error
        finally:
            if self._executor is not executor:
                executor.shutdown(cancel_futures=True)


@contextmanager
def _interrupted_later() -> Iterator[None]:
    """Let Ctrl-C wait for what is done meanwhile: a pool half started neither works nor ends."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    usual = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
    if came:
        signal.raise_signal(signal.SIGINT)


def _start(workers: int) -> ProcessPoolExecutor:
    from concurrent.futures import ProcessPoolExecutor  # noqa: PLC0415  (beside the fork server)

    return ProcessPoolExecutor(
        max_workers=workers,
        mp_context=multiprocessing.get_context(_START_METHOD),
        initializer=init_worker,
    )

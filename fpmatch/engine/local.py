"""The engines of this machine: this process, and several worker processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch.engine.task import init_worker, run_chunk, shared_task
from fpmatch.engine.threads import loaded_single_threaded, safe_import_path, single_threaded
from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from concurrent.futures import Future, ProcessPoolExecutor
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

# A fork server forks each worker from a process that has imported what it needs and run nothing.
_START_METHOD: Final = "forkserver" if sys.platform == "linux" else "spawn"
CHUNKS_IN_FLIGHT: Final = 4  # of each worker: worked on, waiting, or with a result to be taken
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


def start_fork_server(workers: int | None, *modules: str) -> None:
    """Start importing the modules that workers will need, in the process they are forked from.

    For the main thread of a program, not for libraries: that process is started once in the life
    of a program. Without effect for one worker (None: one a core), or where they are not forked.
    """
    if _START_METHOD != "forkserver" or (workers or available_cores()) == 1:
        return
    from multiprocessing import forkserver  # noqa: PLC0415

    context = multiprocessing.get_context(_START_METHOD)
    context.set_forkserver_preload([*_EVERY_WORKER_NEEDS, *modules])
    on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited: Ctrl-C is not for it
    try:
        # no threads in a process that forks
        with safe_import_path(), loaded_single_threaded():
            forkserver.ensure_running()
    finally:
        signal.signal(signal.SIGINT, on_interrupt)


class Serial:
    """Work in this process; see `fpmatch.engine.engine.Engine`."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Work on each chunk when its result is requested."""
        with single_threaded():
            for chunk in chunks:
                yield work(shared, chunk)


class Processes:
    """Work in `workers` processes; see `fpmatch.engine.engine.Engine`."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._held = False
        self._executor: ProcessPoolExecutor | None = None

    def __enter__(self) -> Self:
        self._held = True
        return self

    def __exit__(self, *_: object) -> None:
        self._held = False
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(cancel_futures=True)

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Submit a few chunks at a time, and yield their results in order."""
        from concurrent.futures.process import BrokenProcessPool  # noqa: PLC0415  (as in `_start`)

        executor = self._executor or _start(self._workers)
        if self._held:
            self._executor = executor
        waiting: deque[Future[Any]] = deque()
        try:
            with shared_task(work, shared) as task:
                for chunk in chunks:
                    # submitting may start a worker
                    with _interrupt_deferred(), safe_import_path():
                        waiting.append(executor.submit(run_chunk, task, chunk))
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
def _interrupt_deferred() -> Iterator[None]:
    """Delay Ctrl-C until the block ends: a half-started pool neither works nor ends."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    usual = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
    if received:
        signal.raise_signal(signal.SIGINT)


def _start(workers: int) -> ProcessPoolExecutor:
    from concurrent.futures import ProcessPoolExecutor  # noqa: PLC0415  (while the server starts)

    with safe_import_path():  # its locks start a process of Python's that tracks them
        return ProcessPoolExecutor(
            max_workers=workers,
            mp_context=multiprocessing.get_context(_START_METHOD),
            initializer=init_worker,
        )

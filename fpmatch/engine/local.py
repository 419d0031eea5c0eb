"""The engines of this machine: this process, and several beside it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from concurrent.futures import Future
    from types import TracebackType
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

# A fork server forks each worker from a process that has imported what it needs and run nothing.
_START_METHOD: Final = "forkserver" if sys.platform == "linux" else "spawn"
_BLAS_THREADS: Final = "OPENBLAS_NUM_THREADS"
CHUNKS_IN_FLIGHT: Final = 4  # a worker: what it works on, and what waits for it or to be taken
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

    multiprocessing.get_context(_START_METHOD).set_forkserver_preload(list(modules))
    kept = os.environ.get(_BLAS_THREADS)
    os.environ[_BLAS_THREADS] = "1"  # no threads where processes are forked from
    on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # so it starts, and stays silent
    try:
        forkserver.ensure_running()
    finally:
        signal.signal(signal.SIGINT, on_interrupt)
        del os.environ[_BLAS_THREADS]
        if kept is not None:
            os.environ[_BLAS_THREADS] = kept


class Local:
    """Let go of nothing: what a `map` starts on this machine, it ends."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass


class Here(Local):
    """Work in this process; see `fpmatch.engine.engine.Engine`."""

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


class Cores(Local):
    """Work in several processes; see `fpmatch.engine.engine.Engine`.

    Parameters
    ----------
    workers : int
        How many.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
    ) -> Generator[Result, None, None]:
        """Hand out chunks a few at a time, and their results in order."""
        executor = ProcessPoolExecutor(
            max_workers=self._workers,
            mp_context=multiprocessing.get_context(_START_METHOD),
            initializer=_start_worker,
            initargs=(work, shared),
        )
        waiting: deque[Future[Any]] = deque()
        try:
            for chunk in chunks:
                waiting.append(executor.submit(_work_on, chunk))
                if len(waiting) >= CHUNKS_IN_FLIGHT * self._workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        except BrokenProcessPool as error:
            raise EngineError(_BROKEN) from error
        finally:
            executor.shutdown(cancel_futures=True)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Keep OpenCV and numpy on one thread, so that the cores are not asked twice."""
    import cv2  # noqa: PLC0415
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        cv2.setNumThreads(threads)


# What this worker process was started with; stays empty in the process that started it.
_held: dict[str, Any] = {}


def _start_worker(work: Callable[[Any, Any], Any], shared: object) -> None:
    import cv2  # noqa: PLC0415
    import numpy as np  # noqa: F401, PLC0415  (its library is limited once it is loaded)
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    # Ctrl-C reaches the whole process group: a worker falls silent, its parent reports.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    cv2.setNumThreads(1)
    _held["threads"] = threadpool_limits(1)
    _held["work"], _held["shared"] = work, shared


def _end_with_parent() -> None:
    """End this worker when the process that started it is gone, however it went."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _work_on(chunk: object) -> Any:
    return _held["work"](_held["shared"], chunk)

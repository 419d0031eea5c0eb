"""Do chunks of work on all cores, in order, so that results do not depend on their number.

Worker processes are started afresh ("spawn"), never forked: OpenCV's threads do not survive a
fork. A script that calls into here with more than one worker therefore needs the usual
``if __name__ == "__main__":`` guard.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Progress(Protocol):
    """Be told how far a stage of an evaluation has come."""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Take note that `done` of `total` items of `stage` are finished."""


def no_progress(stage: str, done: int, total: int) -> None:
    """Take no note."""


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_chunks(
    work: Callable[[Shared, Chunk], Result],
    shared: Shared,
    chunks: Sequence[Chunk],
    *,
    workers: int | None = None,
    finished: Callable[[Chunk], None] = lambda _: None,
) -> list[Result]:
    """Return ``[work(shared, chunk) for chunk in chunks]``, computed by several processes.

    OpenCV and numpy run on one thread meanwhile, so that the cores are not asked twice.

    Parameters
    ----------
    work : callable
        A function at the top of a module, called as ``work(shared, chunk)``.
    shared : object
        What all chunks need; sent to each worker once. A worker keeps its copy from chunk to
        chunk, so `work` may leave in it what it does not want to compute twice.
    chunks : sequence
        The pieces of work.
    workers : int, optional
        How many processes (default: one a core); 1 works in this process.
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
    FpmatchError
        If a worker process ended before its work was done.
    """
    count = available_cores() if workers is None else workers
    if count < 1:
        raise ValueError(f"workers must be at least 1, not {count}")
    count = min(count, len(chunks))
    if count <= 1:
        return _run_here(work, shared, chunks, finished)
    executor = ProcessPoolExecutor(
        max_workers=count,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_start_worker,
        initargs=(work, shared),
    )
    results = []
    try:
        futures = [executor.submit(_work_on, chunk) for chunk in chunks]
        for future, chunk in zip(futures, chunks, strict=True):
            results.append(future.result())
            finished(chunk)
    except BrokenProcessPool as error:
        raise FpmatchError(
            "a worker process ended before its work was done: out of memory, or started by a "
            'script without `if __name__ == "__main__":`; one worker needs neither'
        ) from error
    finally:
        executor.shutdown(cancel_futures=True)
    return results


def _run_here(
    work: Callable[[Shared, Chunk], Result],
    shared: Shared,
    chunks: Sequence[Chunk],
    finished: Callable[[Chunk], None],
) -> list[Result]:
    results = []
    with _single_threaded():
        for chunk in chunks:
            results.append(work(shared, chunk))
            finished(chunk)
    return results


@contextmanager
def _single_threaded() -> Iterator[None]:
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
    cv2.setNumThreads(1)
    _held["threads"] = threadpool_limits(1)
    _held["work"], _held["shared"] = work, shared


def _work_on(chunk: object) -> Any:
    return _held["work"](_held["shared"], chunk)

"""What runs in workers: processes of this machine or workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
from contextlib import contextmanager, nullcontext
from functools import lru_cache
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Iterator

TASKS_HELD: Final = 2  # that a worker keeps, the latest ones
_one_at_a_time: Final = Lock()  # workers of a cluster may have several threads
_own: list[bool] = []  # not empty in a process that `init_worker` has prepared


def init_worker() -> None:
    """Prepare a process of this machine: its libraries, and an end with its parent.

    Ctrl-C reaches the whole process group: the parent reports it and ends its workers.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    keep_single_threaded()
    _own.append(True)
    # here, while the parent finds out what there is to do
    import fpmatch.image.extract  # noqa: PLC0415
    import fpmatch.matching.matchers.unit_circle  # noqa: F401, PLC0415


def _end_with_parent() -> None:
    """End this process when the one that started it has ended, for whatever reason."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def run_chunk(task: bytes, chunk: Any) -> Any:
    """Work on a chunk of a task, which `Engine.map` has packed."""
    with _one_at_a_time, nullcontext() if _own else single_threaded():
        work, shared = _unpacked(task)
        return work(shared, chunk)


@lru_cache(TASKS_HELD)
def _unpacked(task: bytes) -> tuple[Any, Any]:
    """Return the function of a task, and what its chunks share."""
    _, version, work, shared = pickle.loads(task)
    if version != __version__:
        raise EngineError(f"a worker has fpmatch {__version__}, not {version}: scores might differ")
    return work, shared


def keep_single_threaded() -> None:
    """Keep OpenCV and numpy of this worker process on one thread from now on."""
    import cv2  # noqa: PLC0415
    import numpy as np  # noqa: F401, PLC0415  (its library is limited once it is loaded)
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    cv2.setNumThreads(1)
    threadpool_limits(1)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Keep OpenCV and numpy on one thread, since the engine uses all cores already."""
    import cv2  # noqa: PLC0415
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        cv2.setNumThreads(threads)

"""What worker processes do: a task is told in a file, which each reads once, and chunk by chunk."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
from contextlib import contextmanager
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory
from threading import Thread
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# The tasks that this worker process is at, by file; stays empty in the process that started it.
_at: dict[Path, tuple[Callable[[Any, Any], Any], Any]] = {}


@contextmanager
def told(work: Callable[[Any, Any], Any], shared: object) -> Iterator[Path]:
    """Keep a file meanwhile that tells workers of a task: a function, and what its chunks share."""
    with TemporaryDirectory(prefix="fpmatch-", ignore_cleanup_errors=True) as folder:
        task = Path(folder, "task")
        task.write_bytes(pickle.dumps((work, shared), pickle.HIGHEST_PROTOCOL))
        yield task


def work_on(task: Path, chunk: object) -> Any:
    """Work on a chunk of a task; of one left off, whose file is gone, it fails and is not missed.

    To cancel the chunk would be less sure: a pool that breaks meanwhile cannot bear it.
    """
    task.stat()
    if task not in _at:
        for done in [other for other in _at if not other.exists()]:
            del _at[done]
        _at[task] = pickle.loads(task.read_bytes())
    work, shared = _at[task]
    return work(shared, chunk)


def init_worker() -> None:
    """Get this process ready for work: on one thread, and for no longer than somebody wants it."""
    import cv2  # noqa: PLC0415
    import numpy as np  # noqa: F401, PLC0415  (its library is limited once it is loaded)
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    # Ctrl-C reaches the whole process group: the parent reports, and lets its workers go when they
    # have done what they are at. One that died in mid-answer would leave it waiting for the rest.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    cv2.setNumThreads(1)
    threadpool_limits(1)


def _end_with_parent() -> None:
    """End this worker when the process that started it is gone, however it went."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        for task in list(_at):  # which nobody else is left to remove
            rmtree(task.parent, ignore_errors=True)
        os._exit(1)

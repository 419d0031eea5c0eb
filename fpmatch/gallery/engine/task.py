"""What worker processes run: they read a task from a file once, then work on its chunks."""

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

from fpmatch.errors import EngineError
from fpmatch.gallery.engine.processes import keep_single_threaded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# The tasks of this worker process, by file; empty in the process that started it.
_tasks: dict[Path, tuple[Callable[[Any, Any], Any], Any]] = {}


def pack_task(work: Callable[[Any, Any], Any], shared: object) -> bytes:
    """Return what workers read of a task: a function, and what its chunks share.

    Raises EngineError for what no other process can be sent, such as a matcher with a lambda.
    """
    try:
        return pickle.dumps((work, shared), pickle.HIGHEST_PROTOCOL)
    except (AttributeError, TypeError, pickle.PicklingError) as error:
        raise EngineError(
            f"cannot be sent to other processes: {error}; one worker needs none"
        ) from error


@contextmanager
def task_file(packed: bytes) -> Iterator[Path]:
    """Keep a file from which workers read a packed task."""
    with TemporaryDirectory(prefix="fpmatch-", ignore_cleanup_errors=True) as folder:
        task = Path(folder, "task")
        task.write_bytes(packed)
        yield task


def run_chunk(task: Path, chunk: object) -> Any:
    """Work on a chunk of a task.

    A chunk of a cancelled task, whose file is gone, fails unnoticed. To cancel the chunk itself
    would be less safe: a pool that breaks meanwhile cannot handle it.
    """
    task.stat()
    if task not in _tasks:
        for done in [other for other in _tasks if not other.exists()]:
            del _tasks[done]
        _tasks[task] = pickle.loads(task.read_bytes())
    work, shared = _tasks[task]
    return work(shared, chunk)


def init_worker() -> None:
    """Prepare this worker process: one thread for libraries, and an end with its parent."""
    # Ctrl-C reaches the whole process group: the parent reports it and ends its workers. A worker
    # that died in the middle of an answer would leave the parent waiting for the rest.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    keep_single_threaded()


def _end_with_parent() -> None:
    """End this worker when the process that started it has ended, for whatever reason."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        for task in list(_tasks):  # no other process is left to remove them
            rmtree(task.parent, ignore_errors=True)
        os._exit(1)

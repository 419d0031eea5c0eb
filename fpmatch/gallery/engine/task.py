"""What worker processes run: they read a task from memory once, then work on its chunks.

A task may contain decrypted templates, so that it is never written to a disk.
"""

from __future__ import annotations

import mmap
import multiprocessing
import os
import pickle
import signal
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from fpmatch.errors import EngineError
from fpmatch.gallery.engine.processes import keep_single_threaded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import BinaryIO

    Identity = tuple[int, int, int]


class Task(NamedTuple):
    """A task in memory: the name by which worker processes of this machine open it."""

    name: str
    identity: Identity | None  # of a file; None of a block of shared memory


# The tasks of this worker process; empty in the process that started it.
_tasks: dict[Task, tuple[Callable[[Any, Any], Any], Any]] = {}


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
def task_in_memory(packed: bytes) -> Iterator[Task]:
    """Keep a packed task in memory that workers read."""
    stream = memory_file(packed)
    if stream is not None:
        with stream:
            yield Task(name_of(stream), identity_of(stream))
        return
    from multiprocessing.shared_memory import SharedMemory  # noqa: PLC0415  (not on Linux)

    block = SharedMemory(create=True, size=len(packed))
    try:
        cast("memoryview", block.buf)[: len(packed)] = packed
        yield Task(block.name, None)
    finally:
        block.close()
        block.unlink()


def memory_file(content: bytes | memoryview) -> BinaryIO | None:
    """Return a file in memory, without a name in any folder; None where others cannot open one.

    It ends with the last process that has it open, even if all are killed.
    """
    if not hasattr(os, "memfd_create"):
        return None
    stream = os.fdopen(os.memfd_create("fpmatch"), "w+b")
    try:
        if not Path(name_of(stream)).exists():
            stream.close()
            return None
        stream.write(content)
        stream.flush()
    except BaseException:
        stream.close()
        raise
    return stream


def name_of(stream: BinaryIO) -> str:
    """Return a path by which processes of this machine open a file that is open here.

    On Linux it leads to that file though another one stands in its place meanwhile.
    """
    name = f"/proc/{os.getpid()}/fd/{stream.fileno()}"
    return name if Path(name).exists() else str(stream.name)


def identity_of(stream: BinaryIO) -> Identity:
    """Return what differs for a file that has taken the place of another."""
    status = os.fstat(stream.fileno())
    return status.st_dev, status.st_ino, status.st_size


def run_chunk(task: Task, chunk: object) -> Any:
    """Work on a chunk of a task.

    A chunk of a cancelled task, which is gone, fails unnoticed. To cancel the chunk itself would be
    less safe: a pool that breaks meanwhile cannot handle it.
    """
    with _opened(task) as packed:
        if task not in _tasks:
            for done in [other for other in _tasks if not _is_there(other)]:
                del _tasks[done]
            _tasks[task] = pickle.loads(packed)
    work, shared = _tasks[task]
    return work(shared, chunk)


@contextmanager
def _opened(task: Task) -> Iterator[mmap.mmap | memoryview]:
    """Map a task into the memory of this worker; OSError where it is gone."""
    if task.identity is None:
        from multiprocessing.shared_memory import SharedMemory  # noqa: PLC0415  (not on Linux)

        block = SharedMemory(task.name)
        try:
            yield cast("memoryview", block.buf)
        finally:
            block.close()
        return
    with Path(task.name).open("rb") as stream:
        if identity_of(stream) != task.identity:
            raise FileNotFoundError(f"{task.name}: another file")
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
            yield content


def _is_there(task: Task) -> bool:
    try:
        with _opened(task):
            return True
    except OSError:
        return False


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
        os._exit(1)

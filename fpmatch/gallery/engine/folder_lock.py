"""A lock on a folder, against other processes of this machine."""

from __future__ import annotations

import os
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def folder_lock(folder: str | os.PathLike[str], *, wait: bool = True) -> Iterator[None]:
    """Lock a folder against other processes; the system releases the lock at the end.

    Without `wait`, a lock that another process holds raises BlockingIOError; a folder that cannot
    be opened, OSError. Where folders cannot be locked, as on Windows, a file beside it is, whose
    name ends in ``.lock``.
    """
    if find_spec("fcntl") is None:
        with _lock_beside(Path(folder), wait=wait):
            yield
        return
    import fcntl  # noqa: PLC0415

    while True:
        handle = os.open(folder, os.O_RDONLY)
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                raise
            except OSError:  # a file system without locks
                pass
            if not _is_open_as(folder, handle):  # another one is in its place
                continue
            yield
            return
        finally:
            os.close(handle)


@contextmanager
def _lock_beside(folder: Path, *, wait: bool) -> Iterator[None]:
    """Lock the file beside a folder that stands for it."""
    from filelock import FileLock, Timeout  # noqa: PLC0415

    folder.stat()
    lock = FileLock(f"{folder}.lock", timeout=-1 if wait else 0)
    try:
        lock.acquire()
    except Timeout as error:
        raise BlockingIOError(f"{folder} is locked") from error
    try:
        yield
    finally:
        lock.release()


def _is_open_as(path: str | os.PathLike[str], handle: int) -> bool:
    try:
        return os.path.samestat(Path(path).stat(), os.fstat(handle))
    except FileNotFoundError:
        return False

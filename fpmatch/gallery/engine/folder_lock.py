"""A lock on a folder, against other processes of this machine."""

from __future__ import annotations

import logging
import os
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_log = logging.getLogger(__name__)


@contextmanager
def folder_lock(folder: str | os.PathLike[str], *, wait: bool = True) -> Iterator[None]:
    """Lock a folder against other processes; the system releases the lock at the end.

    Without `wait`, a lock that another process holds raises BlockingIOError; a folder that cannot
    be opened, OSError. On Windows a file beside it is locked, whose name ends in ``.lock``. Where
    the file system has no locks, a line of the log says so.
    """
    if find_spec("fcntl") is None:
        from filelock import FileLock, Timeout  # noqa: PLC0415

        Path(folder).stat()
        try:
            with FileLock(f"{folder}.lock", blocking=wait):
                yield
        except Timeout as error:
            raise BlockingIOError(f"{folder} is locked") from error
        return
    import fcntl  # noqa: PLC0415

    while True:
        handle = os.open(folder, os.O_RDONLY)
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                raise
            except OSError as error:
                why = f"cannot be locked ({error.strerror}): let one process at a time write there"
                _log.warning("%s: %s", folder, why)
            if Path(folder).exists() and os.path.samestat(Path(folder).stat(), os.fstat(handle)):
                yield
                return
            # else another folder is in its place
        finally:
            os.close(handle)

"""A target of ``python -m research fuzz``, and what the targets share."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import NamedTuple

Read = Callable[[bytes], "Iterable[str] | None"]

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
MEMORY_FOLDER = Path("/dev/shm")


class Reader(NamedTuple):
    """Good files, and a function that reads bytes.

    The function may refuse them by an error of the family FpmatchError; any other error is a bug.
    It may return texts that commands would print. `repair` corrects lengths or checksums of damaged
    bytes, so that what lies behind them is reached.
    """

    corpus: list[bytes]
    read: Read
    repair: Callable[[bytearray], bytes] | None = None


class Target(NamedTuple):
    """The name of a target and what makes its good files and its reader.

    `kernels`: whether it reaches compiled code of fpmatch: then ``--sanitize`` includes it.
    """

    name: str  # of the target; saved inputs are named after it
    make: Callable[[], Reader]  # returns the reader; called once, before processes are forked
    words: tuple[bytes, ...] = ()  # that are put into files
    kernels: bool = False


def scratch() -> Path:
    """Return a folder of this process for files, in memory where the system has such a place."""
    return _scratch_of(os.getpid())


def written(name: str, data: bytes) -> Path:
    """Write bytes to a file of this name in the scratch folder, for its owner alone; return it."""
    path = scratch() / name
    path.write_bytes(data)
    path.chmod(0o600)
    return path


@cache
@cache
def _scratch_of(pid: int) -> Path:
    path = _all_scratch() / str(pid)
    path.mkdir()
    return path


@cache
def _all_scratch() -> Path:
    """Return the folder of all processes; the first one, which forks the others, removes it."""
    folder = MEMORY_FOLDER if os.access(MEMORY_FOLDER, os.W_OK) else None
    path, owner = Path(tempfile.mkdtemp(prefix="fpmatch-fuzz-", dir=folder)), os.getpid()

    def remove() -> None:
        if os.getpid() == owner:
            shutil.rmtree(path, ignore_errors=True)

    atexit.register(remove)
    return path

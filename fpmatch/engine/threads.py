"""What new processes inherit: one thread for numpy and OpenCV, and a safe import path."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator


SAFE_PATH: Final = "PYTHONSAFEPATH"  # Python's variable
_BLAS_THREADS: Final = "OPENBLAS_NUM_THREADS"
_starting: Final = threading.RLock()  # environment variables are shared by all threads


@contextmanager
def loaded_single_threaded() -> Iterator[None]:
    """Let numpy start no threads if it is first imported in the block, here or in a new process.

    For the main thread of a program: environment variables are shared by all threads.
    """
    with _environment(_BLAS_THREADS, "1"):
        yield


@contextmanager
def safe_import_path() -> Iterator[None]:
    """Let Python processes that start in the block import nothing from the working directory.

    Python puts that folder first on the path of a process that it starts for `multiprocessing`.
    """
    with _starting, _environment(SAFE_PATH, "1"):
        yield


@contextmanager
def main_hidden() -> Iterator[None]:
    """Let processes that start in the block not import the script that the user has started.

    They would run it a second time, up to where it calls the library, unless it has a guard.
    """
    main = sys.modules["__main__"]
    with _starting:
        kept = {name: getattr(main, name, None) for name in ("__file__", "__spec__")}
        try:
            for name in kept:
                setattr(main, name, None)
            yield
        finally:
            for name, value in kept.items():
                setattr(main, name, value)
            if kept["__file__"] is None:
                del main.__file__


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    kept = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if kept is not None:
            os.environ[name] = kept


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

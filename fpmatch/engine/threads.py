"""Libraries that would start threads of their own, kept to one."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator


_BLAS_THREADS: Final = "OPENBLAS_NUM_THREADS"


@contextmanager
def loaded_single_threaded() -> Iterator[None]:
    """Let numpy, where it is first imported meanwhile, start no threads, here or in a new process.

    It is for a program's main thread: environment variables are all threads' own.
    """
    kept = os.environ.get(_BLAS_THREADS)
    os.environ[_BLAS_THREADS] = "1"
    try:
        yield
    finally:
        del os.environ[_BLAS_THREADS]
        if kept is not None:
            os.environ[_BLAS_THREADS] = kept


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

"""Limits on the threads that numpy and OpenCV start."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator


_BLAS_THREADS: Final = "OPENBLAS_NUM_THREADS"


@contextmanager
def loaded_single_threaded() -> Iterator[None]:
    """Let numpy start no threads if it is first imported in the block, here or in a new process.

    For the main thread of a program: environment variables are shared by all threads.
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

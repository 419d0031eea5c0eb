"""Cores of this process, and how numpy and heavy imports start no threads."""

from __future__ import annotations

import gc
import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator


_BLAS_THREADS: Final = "OPENBLAS_NUM_THREADS"


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def loaded_single_threaded() -> Iterator[None]:
    """Let numpy start no threads if it is first imported in the block, here or in a new process.

    For the main thread of a program: environment variables are shared by all threads.
    """
    with environment(_BLAS_THREADS, "1"):
        yield


@contextmanager
def fast_imports() -> Iterator[None]:
    """Import heavy modules without threads, which would occupy a core that workers need.

    There is no garbage collection meanwhile, nor of these modules later: they leave none.
    """
    gc.disable()
    try:
        with loaded_single_threaded():
            yield
    finally:
        gc.freeze()
        gc.enable()


@contextmanager
def environment(name: str, value: str) -> Iterator[None]:
    """Set a variable of the environment in the block."""
    kept = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if kept is not None:
            os.environ[name] = kept

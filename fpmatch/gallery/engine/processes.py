"""What new processes inherit: one thread for numpy, the path of imports, no Ctrl-C."""

from __future__ import annotations

import os
import signal
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from fpmatch.base.threads import environment

if TYPE_CHECKING:
    from collections.abc import Iterator


SAFE_PATH: Final = "PYTHONSAFEPATH"  # Python's variables
PATH: Final = "PYTHONPATH"
_starting: Final = threading.RLock()  # environment variables are shared by all threads


@contextmanager
def safe_import_path() -> Iterator[None]:
    """Let Python processes that start in the block import from where this one does.

    Python puts the working directory first on the path of a process that it starts for
    `multiprocessing`, and a fork server imports before it gets the path of this process: of two
    copies of fpmatch, it would import the installed one.
    """
    path = os.pathsep.join(filter(None, sys.path))
    with _starting, environment(SAFE_PATH, "1"), environment(PATH, path):
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
def interrupt_deferred() -> Iterator[None]:
    """Delay Ctrl-C until the block ends; processes that start in it never receive it.

    It reaches the whole process group: the parent reports it and ends its workers. A half-started
    pool neither works nor ends, and a process that is importing would print a traceback.
    """
    with _interrupt_blocked():
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        received: list[int] = []
        usual = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, usual)
            if received:  # instead of any error, which is a consequence
                signal.raise_signal(signal.SIGINT)


@contextmanager
def interrupt_kept_from_children() -> Iterator[None]:
    """Let processes that the main thread starts in the block never receive Ctrl-C.

    Another thread receives it for this process, and its handler runs in the main thread as usual.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    ended = threading.Event()
    receiver = threading.Thread(target=ended.wait, daemon=True)
    receiver.start()
    try:
        with _interrupt_blocked():
            yield
    finally:
        ended.set()


@contextmanager
def _interrupt_blocked() -> Iterator[None]:
    """Block Ctrl-C in this thread and in processes that it starts, where systems know such masks.

    Python's tracker of shared resources is started before, since its start ends the block.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker  # noqa: PLC0415

    with safe_import_path():
        resource_tracker.ensure_running()
    kept = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, kept)


def keep_single_threaded() -> None:
    """Keep OpenCV and numpy of this worker process on one thread from now on."""
    import cv2  # noqa: PLC0415
    import numpy as np  # noqa: F401, PLC0415  (its library is limited once it is loaded)
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    cv2.setNumThreads(1)
    threadpool_limits(1)


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

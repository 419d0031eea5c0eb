"""Ctrl-C of a server: it reaches the whole process group, and the server ends its workers."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING

from fpmatch.base.threads import environment

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def interrupt_kept_from_children() -> Iterator[None]:
    """Let processes that the main thread starts in the block never receive Ctrl-C.

    Another thread receives it for this process, and its handler runs in the main thread as usual.
    """
    in_main = threading.current_thread() is threading.main_thread()
    if not (in_main and hasattr(signal, "pthread_sigmask")):
        yield
        return
    with environment("PYTHONSAFEPATH", "1"):  # its start would end the block of the signal
        resource_tracker.ensure_running()
    ended = threading.Event()
    threading.Thread(target=ended.wait, daemon=True).start()
    kept = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, kept)
        ended.set()

"""Ctrl-C where Python swallows it: in destructors and in callbacks of C code."""

from __future__ import annotations

import signal
import sys
import threading
from _thread import interrupt_main
from typing import Any, Final

AGAIN_S: Final = 0.02  # by when the destructor has ended


def repeat_swallowed_interrupts() -> None:
    """Send Ctrl-C again where it came in a destructor, which ignores and prints all errors."""
    usual = sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            timer = threading.Timer(AGAIN_S, _interrupt)
            timer.daemon = True
            timer.start()
        else:
            usual(unraisable)

    sys.unraisablehook = hook


def _interrupt() -> None:
    """Interrupt the main thread, also in a system call that waits."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        interrupt_main()

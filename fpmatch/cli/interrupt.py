"""Ctrl-C where it would be lost: in destructors, callbacks, and modules that ignore all errors."""

from __future__ import annotations

import signal
import sys
import threading
import time
from _thread import interrupt_main, start_new_thread
from typing import Any, Final

from fpmatch.cli import is_interrupt

AGAIN_S: Final = 0.1  # in which an interrupt that is not lost reaches what ends the work


def repeat_swallowed_interrupts() -> None:
    """Send Ctrl-C again until the main thread handles it, and print none that is ignored."""
    if threading.current_thread() is not threading.main_thread():
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, interrupt_and_watch)
    usual = sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            usual(unraisable)

    sys.unraisablehook = hook


def interrupt_and_watch(number: int, frame: object) -> None:
    """Raise KeyboardInterrupt, as Python's own handler does, and see that it is handled."""
    start_new_thread(_repeat_if_lost, ())  # takes no lock, which the main thread may hold
    raise KeyboardInterrupt


def _repeat_if_lost() -> None:
    """Interrupt the main thread again, also in a system call, unless it is ending its work."""
    time.sleep(AGAIN_S)
    main = threading.main_thread().ident or 0
    current: Any = sys._current_exceptions().get(main)
    error = current[1] if isinstance(current, tuple) else current  # a tuple before Python 3.12
    handled = error is not None and is_interrupt(error)
    if handled or signal.getsignal(signal.SIGINT) is not interrupt_and_watch:
        return
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main, signal.SIGINT)
    else:
        interrupt_main()

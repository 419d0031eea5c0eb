"""The command line: thin commands that parse, call and print.

``main`` is what the console script ``fpmatch`` and ``python -m fpmatch`` run.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading
import time
from _thread import interrupt_main, start_new_thread

TYPE_CHECKING = False  # importing `typing` takes longer than all of this, and is not guarded
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

__all__ = ["main"]

EXIT_INTERRUPTED = 130  # 128 + SIGINT, as shells report it
AGAIN_S = 0.1  # in which an interrupt that is not lost reaches what ends the work


def main(args: Sequence[str] | None = None, prog_name: str | None = None) -> None:
    """Run the command line, and exit with its status.

    The commands are imported here, since worker processes import the script that calls this
    function but do not call it. `args` and `prog_name` are as for `click.Command.main`.
    """
    try:
        from fpmatch.cli.group import fpmatch

        os.environ["PYTHONSAFEPATH"] = "1"  # its processes import nothing from its directory
        atexit.register(gc.freeze)  # the system reclaims all memory: no last garbage collection
        repeat_swallowed_interrupts()
        fpmatch(args=args, prog_name=prog_name)
    except BaseException as error:
        if not is_interrupt(error):
            raise
        sys.exit(EXIT_INTERRUPTED)
    finally:
        _end_at_interrupt()


def is_interrupt(error: BaseException) -> bool:
    """Return whether an error is Ctrl-C, or was raised because of it, as Python itself may do."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def repeat_swallowed_interrupts() -> None:
    """Send Ctrl-C again until the main thread handles it, and print none that is ignored.

    It would be lost in destructors, callbacks, and modules that ignore all errors.
    """
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


def _end_at_interrupt() -> None:
    """Let Ctrl-C end this process, which has done its work, without a traceback."""
    heeded = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    if heeded and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)

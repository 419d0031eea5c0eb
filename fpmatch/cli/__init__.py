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

TYPE_CHECKING = False  # importing `typing` takes longer than all of this, and is not guarded
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

__all__ = ["main"]

EXIT_INTERRUPTED = 130  # 128 + SIGINT, as shells report it


def main(args: Sequence[str] | None = None, prog_name: str | None = None) -> None:
    """Run the command line, and exit with its status.

    The commands are imported here, since worker processes import the script that calls this
    function but do not call it. `args` and `prog_name` are as for `click.Command.main`.
    """
    try:
        from fpmatch.cli.group import fpmatch

        os.environ["PYTHONSAFEPATH"] = "1"  # its processes import nothing from its directory
        atexit.register(gc.freeze)  # the system reclaims all memory: no last garbage collection
        ignore_lost_interrupts()
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


def ignore_lost_interrupts() -> None:
    """Print nothing of Ctrl-C where Python cannot raise it: in destructors and callbacks."""
    usual = sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            usual(unraisable)

    sys.unraisablehook = hook


def _end_at_interrupt() -> None:
    """Let Ctrl-C end this process, which has done its work, without a traceback."""
    heeded = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    if heeded and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)

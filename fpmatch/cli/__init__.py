"""The command line: thin commands that parse, call and print.

``main`` is what the console script ``fpmatch`` and ``python -m fpmatch`` run.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys

TYPE_CHECKING = False  # importing `typing` takes longer than all of this, and is not guarded
if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]

EXIT_INTERRUPTED = 130  # 128 + SIGINT, as shells report it


def main(args: Sequence[str] | None = None, prog_name: str | None = None) -> None:
    """Run the command line, and exit with its status.

    The commands are imported here, since worker processes import the script that calls this
    function but do not call it. `args` and `prog_name` are as for `click.Command.main`.
    """
    report = sys.unraisablehook
    try:
        os.environ["PYTHONSAFEPATH"] = "1"  # its processes import nothing from its directory
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # workers need the cores
        atexit.register(gc.freeze)  # the system reclaims all memory: no last garbage collection
        # Ctrl-C in a destructor or a callback, where Python cannot raise it, is not printed
        sys.unraisablehook = lambda lost: (
            None if lost.exc_type is KeyboardInterrupt else report(lost)
        )
        from fpmatch.cli.group import fpmatch

        fpmatch(args=args, prog_name=prog_name)
    except (KeyboardInterrupt, Exception) as error:
        if not is_interrupt(error):
            raise
        sys.exit(EXIT_INTERRUPTED)
    finally:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # the work is done: no traceback


def is_interrupt(error: BaseException) -> bool:
    """Return whether an error is Ctrl-C, or was raised because of it, as Python itself may do."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None

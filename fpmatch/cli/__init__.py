"""The command line: thin commands that parse, call and print.

``main`` is what the console script ``fpmatch`` and ``python -m fpmatch`` run.
"""

from __future__ import annotations

import atexit
import gc
import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["main"]


def main(args: Sequence[str] | None = None, prog_name: str | None = None) -> None:
    """Run the command line, and exit with its status.

    The commands are imported here, since worker processes import the script that calls this
    function but do not call it. `args` and `prog_name` are as for `click.Command.main`.
    """
    from fpmatch.cli.group import fpmatch
    from fpmatch.engine.threads import SAFE_PATH

    os.environ[SAFE_PATH] = "1"  # processes of the command import nothing from its directory
    atexit.register(gc.freeze)  # the system reclaims all memory: no last garbage collection
    fpmatch(args=args, prog_name=prog_name)


@contextmanager
def fast_imports() -> Iterator[None]:
    """Import heavy modules without threads, which would occupy a core that workers need.

    There is no garbage collection meanwhile, nor of these modules later: they leave none.
    """
    from fpmatch.engine.threads import loaded_single_threaded

    gc.disable()
    try:
        with loaded_single_threaded():
            yield
    finally:
        gc.freeze()
        gc.enable()

"""The command line: thin commands that parse, call and print.

``main`` is what the console script ``fpmatch`` and ``python -m fpmatch`` run.
"""

from __future__ import annotations

import atexit
import gc
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(args: Sequence[str] | None = None, prog_name: str | None = None) -> None:
    """Run the command line, and exit with its status.

    Worker processes import the script that calls this, and never call it: so it is here that the
    commands are imported.

    Parameters
    ----------
    args : sequence of str, optional
        The words after the command (default: those of this process).
    prog_name : str, optional
        What the command is called in its help (default: as it was started).
    """
    from fpmatch.cli.group import fpmatch

    atexit.register(gc.freeze)  # the system takes back all there is: no need to look for garbage

    fpmatch(args=args, prog_name=prog_name)

"""The command line: thin commands that parse, call and print.

``main`` is what the console script ``fpmatch`` and ``python -m fpmatch`` run.
"""

from fpmatch.cli.group import fpmatch as main

__all__ = ["main"]

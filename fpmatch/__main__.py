"""Run the command line as ``python -m fpmatch``."""

import sys
from pathlib import Path

from fpmatch.cli import EXIT_INTERRUPTED, main

if __name__ == "__main__":
    try:
        # `python -m` puts the working directory first on the path: only this package may lie there.
        if not sys.flags.safe_path and Path(sys.path[0]) != Path(__file__).parents[1]:
            del sys.path[0]
        main(prog_name="fpmatch")
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)

"""Development of fpmatch: what trains it, measures it, checks it and draws its documentation.

The package is not installed. ``python -m research --help``, run from the repository's root, lists
its commands; the scripts in ``research/benchmarks/`` use it too. The example
``examples/revocable``, which is measured, can be imported.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "examples" / "revocable"))

"""Make the packages of the repository importable in a benchmark that is run as a script.

The root stands last on the path: it holds the sources of `fpmatch`, too, and an installed one
comes first.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT))

"""Make `planted_targets` importable for the tests beside it, and for the processes they start."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))

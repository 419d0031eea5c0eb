"""Tests of the index make prints as those of matching do."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "matching"))

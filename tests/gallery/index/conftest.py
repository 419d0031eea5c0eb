"""Tests of the index make prints as those of matching do."""

import sys
from pathlib import Path

sys.path += map(str, (Path(__file__).parents[2] / "matching", Path(__file__).parent))

"""The strategies of `tests/pointset` and the arranged sets, for the tests beside this."""

import sys
from pathlib import Path

sys.path += [str(Path(__file__).parents[2] / "pointset"), str(Path(__file__).parent)]

"""The strategies of `tests/pointset`, and the kernels' plain form, for the tests beside this."""

import sys
from pathlib import Path

from tests.pointset.conftest import plain  # noqa: F401

sys.path.append(str(Path(__file__).parents[2] / "pointset"))

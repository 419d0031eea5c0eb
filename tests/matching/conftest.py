"""Make the helper modules beside the tests importable, and the kernels as ordinary Python."""

import sys
from pathlib import Path

import pytest

from fpmatch import extract

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def print_(fingers):
    """Return a finger that never was as it is extracted."""
    return extract(fingers[0], dpi=500)

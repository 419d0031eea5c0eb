"""Make `pointset_strategies` importable for the tests beside it, and a kernel's plain form."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def interpreted_kernel(interpreted: Callable[[str], ModuleType]) -> ModuleType:
    """Return the one-ring kernel as ordinary Python."""
    return interpreted("_one_ring_kernel")

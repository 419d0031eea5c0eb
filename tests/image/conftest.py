"""Make `made_images` importable for the tests beside it, and the tracing kernel's plain form."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def interpreted_trace_kernel(interpreted: Callable[[str], ModuleType]) -> ModuleType:
    """Return the tracing kernel as ordinary Python, whether or not it is compiled as well."""
    return interpreted("_trace_kernel")

"""Make `pointset_strategies` importable for the tests beside it, and the kernel's plain form."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

import fpmatch.pointset

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def interpreted_kernel() -> ModuleType:
    """Return the one-ring kernel as ordinary Python, whether or not it is compiled as well."""
    source = Path(fpmatch.pointset.__file__).with_name("_one_ring_kernel.py")
    spec = importlib.util.spec_from_file_location("interpreted_one_ring_kernel", source)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert not module.COMPILED
    return module

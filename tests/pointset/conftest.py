"""Make `pointset_strategies` importable for the tests beside it, and the kernels' plain form."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

import fpmatch.pointset

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def interpreted() -> Callable[[str], ModuleType]:
    """Return the function that loads a kernel as ordinary Python, compiled or not besides."""

    def load(name: str) -> ModuleType:
        source = Path(fpmatch.pointset.__file__).with_name(f"{name}.py")
        spec = importlib.util.spec_from_file_location(f"interpreted{name}", source)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert not module.COMPILED
        return module

    return load


@pytest.fixture(scope="session")
def interpreted_kernel(interpreted: Callable[[str], ModuleType]) -> ModuleType:
    """Return the one-ring kernel as ordinary Python."""
    return interpreted("_one_ring_kernel")

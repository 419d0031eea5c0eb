"""Make `made_images` importable for the tests beside it, and the tracing kernel's plain form."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

import fpmatch.image

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def interpreted_trace_kernel() -> ModuleType:
    """Return the tracing kernel as ordinary Python, whether or not it is compiled as well."""
    source = Path(fpmatch.image.__file__).with_name("_trace_kernel.py")
    spec = importlib.util.spec_from_file_location("interpreted_trace_kernel", source)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert not module.COMPILED
    return module

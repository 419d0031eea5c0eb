"""The examples in the docstrings of `fpmatch` and `research`."""

import doctest
import importlib
import pkgutil

import pytest

import fpmatch
import research

NEEDS_TORCH = {
    f"research.training.{name}" for name in ("embedding_net", "enhancer_net", "networks")
}
PROGRAMS = {"fpmatch.__main__", "research.__main__"}
MODULES = {
    one.name
    for package in (fpmatch, research)
    for one in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
}


@pytest.mark.parametrize("name", sorted(MODULES - NEEDS_TORCH - PROGRAMS))
def test_examples(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0

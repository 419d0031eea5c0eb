"""The examples in the docstrings of `research`."""

import doctest
import importlib
import pkgutil

import pytest

import research

NEEDS_TORCH = {"research.training.enhancer", "research.training.enhancer_net"}
MODULES = {one.name for one in pkgutil.walk_packages(research.__path__, "research.")}


@pytest.mark.parametrize("name", sorted(MODULES - NEEDS_TORCH - {"research.__main__"}))
def test_examples(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0

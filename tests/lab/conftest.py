"""Databases of prints that a fake extractor reads."""

import importlib
from pathlib import Path

import pytest


@pytest.fixture
def bench(monkeypatch):
    """The module `fake_bench`, importable in worker processes too."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "evaluation"))
    return importlib.import_module("fake_bench")


@pytest.fixture
def make_database(tmp_path, bench):
    """Write a database of prints that `fake_bench.extractor` understands."""

    def make(name="db", fingers=5, impressions=4, contents=None, toml=None):
        return bench.write_database(tmp_path / name, fingers, impressions, contents, toml)

    return make

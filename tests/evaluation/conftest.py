"""Make `truth_files` importable for the tests beside it; databases whose answers are known."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture
def bench(monkeypatch):
    """The module `fake_bench`, importable in worker processes too."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    return importlib.import_module("fake_bench")


@pytest.fixture
def make_database(tmp_path):
    """Write a database of prints that `fake_bench.extractor` understands."""

    def make(name="db", fingers=5, impressions=4, contents=None, toml=None):
        folder = tmp_path / name
        folder.mkdir()
        for finger in range(1, fingers + 1):
            for number in range(1, impressions + 1):
                stem = f"{finger}_{number}"
                (folder / f"{stem}.tif").write_text((contents or {}).get(stem, "print"))
        if toml is not None:
            (folder / "dataset.toml").write_text(toml)
        return folder

    return make

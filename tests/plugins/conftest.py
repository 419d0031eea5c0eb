"""A folder for packages that this process finds, and commands that run in it."""

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch.base.plugins import forget_plugins
from fpmatch.cli.group import fpmatch

sys.path.append(str(Path(__file__).parent))


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Return a folder for packages that this process imports from; call `forget_plugins` after."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    known = set(sys.modules)
    yield folder
    monkeypatch.undo()
    for name in set(sys.modules) - known:
        if str(getattr(sys.modules[name], "__file__", "")).startswith(str(folder)):
            del sys.modules[name]
    forget_plugins()


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Return a function that runs ``fpmatch`` with the given words, in a folder of its own."""
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return lambda *words: CliRunner().invoke(fpmatch, [*map(str, words)], prog_name="fpmatch")

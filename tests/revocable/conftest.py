"""Make the example importable, and install what its pyproject.toml adds to fpmatch."""

import sys
import tomllib
from pathlib import Path

import pytest

from fpmatch.base.plugins import forget_plugins

EXAMPLE = Path(__file__).parents[2] / "examples" / "revocable"
sys.path += [str(EXAMPLE), str(Path(__file__).parents[1] / "plugins")]

from plugin_packages import install_points  # noqa: E402


@pytest.fixture
def installed(tmp_path_factory, monkeypatch):
    """Install the entry points of the example."""
    site = tmp_path_factory.mktemp("site")
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text("utf-8"))["project"]
    install_points(site, project["name"], project["entry-points"])
    monkeypatch.syspath_prepend(str(site))
    forget_plugins()
    yield project
    monkeypatch.undo()
    forget_plugins()

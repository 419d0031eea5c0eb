"""Old names of modules, which the README, the documentation or plug-ins once used."""

import subprocess
import sys
from pathlib import Path

import pytest

import fpmatch
from fpmatch.base.moved import MOVED


def test_every_new_place_is_a_module_and_no_old_one_is():
    names = [f"fpmatch.{name}" for name in MOVED.values()]
    code = f"import importlib; [importlib.import_module(name) for name in {names}]"
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)
    package = Path(fpmatch.__file__).parent
    places = [package.joinpath(*name.split(".")) for name in MOVED]
    assert not [place for place in places if place.is_dir() or place.with_suffix(".py").exists()]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("fpmatch.minutiae", "fpmatch.templates.minutiae"),
        ("fpmatch.engine.engine", "fpmatch.gallery.engine.engine"),
        ("fpmatch.client", "fpmatch.server.client"),
    ],
)
def test_an_import_by_an_old_name_is_the_module_itself_and_one_line_names_the_new(old, new):
    code = f"import {old} as old, {new} as new, sys; assert old is new, old; print(new.__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == f"{new}\n"
    assert [line for line in done.stderr.splitlines() if f"is now {new}" in line]


def test_other_names_are_not_there():
    for name in ("fpmatch.nothing", "fpmatch.engine.nothing"):
        code = f"import {name}"
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=False
        )
        assert "ModuleNotFoundError" in done.stderr

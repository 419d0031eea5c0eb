"""`fpmatch doctor`: what is installed, and whether the kernels are compiled."""

import importlib
import json
import re
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest

import fpmatch
from fpmatch.base import kernels
from fpmatch.base.threads import available_cores
from fpmatch.cli import doctor as installation
from fpmatch.matching.compiled import COMPILED


def test_kernels_are_compiled_where_they_are_loaded_so():
    states = kernels.compiled_kernels()
    assert len(states) > 20
    assert set(states.values()) == {COMPILED}
    for name, compiled in states.items():
        assert str(importlib.import_module(name).__file__).endswith(".py") is not compiled


@pytest.mark.parametrize(
    ("states", "row"),
    [([True, True], "2 of 2 compiled\n"), ([True, False], "1 of 2 compiled: slow; with ")],
)
def test_what_is_not_compiled_is_named(monkeypatch, states, row):
    compiled = dict(zip("ab", states, strict=True))
    monkeypatch.setattr(installation, "compiled_kernels", lambda: compiled)
    text = one_space(installation.installation_text(installation.inspect_installation()))
    assert f"\nkernels {row}" in text


def test_everything_that_is_installed_is_listed(run):
    result = run("doctor")
    assert result.exit_code == 0
    lines = dict(line.split("  ", 1) for line in result.stdout.splitlines())
    assert lines["cores"].strip() == str(available_cores())
    assert f"numpy {np.__version__}" in lines["packages"]
    document = json.loads(run("doctor", "--json").stdout)
    assert document["version"] == fpmatch.__version__
    assert document["problems"] == []
    assert {"plot", "web", "dask"} <= set(document["extras"])
    assert "dev" not in document["extras"]


def one_space(text):
    """Return a table without the widths of its columns."""
    return re.sub(" +", " ", text)


def test_a_missing_package_is_named(run, monkeypatch):
    def version(name):
        if name in {"scipy", "pyarrow"}:
            raise PackageNotFoundError(name)
        return "9"

    monkeypatch.setattr(installation, "version", version)
    result = run("doctor")
    assert result.exit_code == 1
    assert result.stderr.startswith("fpmatch: error: scipy ")
    assert "scipy missing" in result.stdout
    assert "extra parquet pyarrow missing" in one_space(result.stdout)


def test_doctor_lists_the_parameters_of_matchers(run):
    listed = json.loads(run("doctor", "--matchers", "--json").stdout)
    known = {one["name"]: one for one in listed["unit-circle"]}
    assert (known["rounds"]["value"], known["reach_px"]["unit"]) == (3, "px at 500 dpi")
    text = run("doctor", "--matchers").stdout
    assert all(f"\n    {name} " in text for name in known)
    assert "reference\n    the parameters of unit-circle" in text
    assert {one["name"] for one in listed["paper"]} >= {"rho", "precision"}

"""`fpmatch doctor`, and notes of commands that kernels are not compiled, or out of date."""

import json
import re
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest
from click.testing import CliRunner

import fpmatch
from fpmatch.base import kernels
from fpmatch.base.kernels import slow_kernels_note
from fpmatch.base.threads import available_cores
from fpmatch.cli import doctor as installation
from research.commands import Command
from tests.conftest import copied

NAMES = [f"fpmatch._{letter}_kernel" for letter in "abcde"]
NOTE = "fpmatch: note: 5 kernels out of date"


@pytest.fixture
def outdated(monkeypatch):
    """Let five kernels be out of date."""
    for module in (kernels, installation):
        monkeypatch.setattr(module, "outdated_kernels", lambda: NAMES)


@pytest.mark.usefixtures("outdated")
def test_a_command_notes_outdated_kernels_once_and_its_result_is_as_it_was(run, prints):
    result = run("verify", prints / "1_1.png", prints / "1_1.png", "--json")
    assert (result.exit_code, result.stderr.count("\n")) == (0, 1)
    assert result.stderr.startswith(NOTE)
    assert json.loads(result.stdout)["match"] is True
    of_research = CliRunner().invoke(Command("measure", callback=lambda: None))
    assert (of_research.exit_code, of_research.stderr.startswith(NOTE)) == (0, True)


@pytest.mark.parametrize(
    ("words", "noted"),
    [
        ("verify {set}/1_1.png {set}/1_2.png", False),
        ("extract {set}/1_1.png {set}/2_1.png -o {new}", True),
        ("enrol {new}.db {set}", True),
        ("identify {gallery} {set}/1_1.png", True),
        ("evaluate {set} --bootstrap 0 --workers 1", True),
        ("score --references {set} --probes {set} -o {new}.csv --workers 1", True),
    ],
)
def test_batches_note_first_that_kernels_are_not_compiled(
    run, prints, gallery, tmp_path, monkeypatch, words, noted
):
    states = dict(zip("abc", (True, False, False), strict=True))
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: states)
    monkeypatch.setattr(kernels, "slow_kernels_note", slow_kernels_note)
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png", "2_1.png")
    given = words.format(set=folder, gallery=gallery, new=tmp_path / "new").split()
    result = run(*given, "--json")
    assert result.exit_code == 0, result.stderr
    assert result.stderr.startswith("fpmatch: note: 2 of 3 kernels are not compiled") is noted
    assert result.stderr.count("kernels") == noted


@pytest.mark.usefixtures("outdated")
def test_kernels_that_are_slow_or_out_of_date_are_named(run, monkeypatch):
    monkeypatch.setattr(installation, "compiled_kernels", lambda: {"a": True, "b": False})
    result = run("doctor")
    (row,) = [line for line in result.stdout.splitlines() if line.startswith("kernels")]
    assert "1 of 2 compiled: slow; " in row
    assert row.endswith(", ".join(NAMES))
    document = json.loads(run("doctor", "--json").stdout)
    assert document["outdated_kernels"] == NAMES
    note, problem = result.stderr.splitlines()
    assert (result.exit_code, problem) == (1, f"fpmatch: error: {document['problems'][0]}")
    assert note.startswith(NOTE)


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


def test_a_missing_package_is_named(run, monkeypatch):
    def version(name):
        if name in {"scipy", "distributed"}:
            raise PackageNotFoundError(name)
        return "9"

    monkeypatch.setattr(installation, "version", version)
    result = run("doctor")
    assert result.exit_code == 1
    assert result.stderr.startswith("fpmatch: error: scipy ")
    assert "scipy missing" in result.stdout
    assert re.search("extra dask +distributed missing", result.stdout)


def test_doctor_lists_the_parameters_of_matchers(run):
    listed = json.loads(run("doctor", "--matchers", "--json").stdout)
    known = {one["name"]: one for one in listed["unit-circle"]}
    assert (known["rounds"]["value"], known["reach_px"]["unit"]) == (3, "px at 500 dpi")
    text = run("doctor", "--matchers").stdout
    assert all(f"\n    {name} " in text for name in known)
    assert "reference\n    the parameters of unit-circle" in text
    assert {one["name"] for one in listed["paper"]} >= {"rho", "precision"}

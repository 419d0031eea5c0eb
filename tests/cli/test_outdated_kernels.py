"""What commands say where kernels were compiled from files that have changed since."""

import importlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fpmatch
from fpmatch.base import kernels
from fpmatch.cli import doctor as installation
from fpmatch.cli.group import summaries
from fpmatch.matching.pipeline._kernels._local_kernel import COMPILED

NAMES = [f"fpmatch._{letter}_kernel" for letter in "abcde"]
NOTE = "fpmatch: note: kernels out of date: fpmatch._a_kernel, fpmatch._b_kernel, "
MENDED_BY = "`scripts/build`"


@pytest.fixture(autouse=True)
def outdated(monkeypatch):
    """Let five kernels of a source tree be out of date."""
    evaluate = importlib.import_module("fpmatch.lab.cli.evaluate")
    for module in (kernels, installation, evaluate):
        monkeypatch.setattr(module, "outdated_kernels", lambda: NAMES)
        monkeypatch.setattr(module, "build_command", lambda: "scripts/build")
    monkeypatch.setattr(kernels, "in_source_tree", lambda: True)


@pytest.mark.parametrize("name", [name for name in summaries() if name != "doctor"])
def test_every_command_of_a_source_tree_notes_it_once(run, name):
    (note,) = run(name, "--help").stderr.splitlines()
    assert note.startswith(NOTE)
    assert MENDED_BY in note


def test_results_are_as_they_were(run, prints):
    result = run("verify", prints / "1_1.png", prints / "1_1.png", "--json")
    assert result.exit_code == 0
    assert result.stderr.startswith(NOTE)
    assert json.loads(result.stdout)["match"] is True


def test_other_installations_do_not_look(run, monkeypatch):
    monkeypatch.setattr(kernels, "in_source_tree", lambda: False)
    assert run("verify", "--help").stderr == ""


def test_doctor_names_each_and_the_command_that_mends_it(run):
    result = run("doctor")
    assert (result.exit_code, MENDED_BY in result.stderr) == (1, True)
    (row,) = [line for line in result.stdout.splitlines() if line.startswith("kernels")]
    assert row.endswith(", ".join(NAMES))
    document = json.loads(run("doctor", "--json").stdout)
    assert document["outdated_kernels"] == NAMES
    (problem,) = document["problems"]
    assert result.stderr == f"fpmatch: error: {problem}\n"


def test_the_version_says_how_many(run):
    assert f"(5 of {len(kernels.compiled_kernels())} kernels " in run("--version").output


def test_no_baseline_is_compared_with_them(run, prints, tmp_path):
    scores = tmp_path / "scores.csv"
    scores.write_text("probe,reference,score\n1_1,1_2,50\n1_1,2_1,1\n2_1,2_2,60\n1_2,2_2,2\n")
    result = run("evaluate", prints, "--baseline", scores)
    assert (result.exit_code, result.stdout) == (2, "")
    note, error = result.stderr.splitlines()
    assert note.startswith(NOTE)
    assert "--baseline" in error
    given = run("rates", scores, "--baseline", scores, "--bootstrap", 0)
    assert given.exit_code == 0, given.stderr


def test_commands_of_research_note_it(run_research):
    result = run_research("fuzz", "--list")
    assert (result.exit_code, result.stderr.startswith(NOTE)) == (0, True)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="the kernels are not compiled")
def test_a_kernel_that_is_edited_is_noted_until_it_is_as_before(prints, tmp_path):
    """As a user edits it: the whole package in a source tree, in a process of its own."""
    package = tmp_path / "fpmatch"
    shutil.copytree(Path(fpmatch.__file__).parent, package)
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "build").touch()
    (kernel,) = package.rglob("_alignment_kernel.py")
    as_before = kernel.read_bytes()
    command = [sys.executable, "-m", "fpmatch", "verify", prints / "1_1.png", prints / "2_1.png"]
    options = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": str(tmp_path)}}
    for text, noted in (
        (as_before, False),
        (as_before.replace(b"1.06", b"1.07"), True),
        (as_before, False),
    ):
        kernel.write_bytes(text)
        os.utime(kernel, (0, 0))
        done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
        assert done.stderr.count("\n") == done.stderr.count("_alignment_kernel; ") == noted

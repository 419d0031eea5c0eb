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
from fpmatch.cli.group import SUMMARIES
from fpmatch.matching.pipeline._kernels._local_kernel import COMPILED

NAMES = [f"fpmatch._{letter}_kernel" for letter in "abcde"]
NOTE = (
    "fpmatch: note: kernels out of date: fpmatch._a_kernel, fpmatch._b_kernel, fpmatch._c_kernel "
    "and 2 more; results may be those of earlier files until `scripts/build` compiles them\n"
)
MENDED_BY = "kernels out of date: `scripts/build` compiles them"


@pytest.fixture(autouse=True)
def outdated(monkeypatch):
    """Let five kernels of a source tree be out of date."""
    evaluate = importlib.import_module("fpmatch.lab.cli.evaluate")
    for module in (kernels, installation, evaluate):
        monkeypatch.setattr(module, "outdated_kernels", lambda: NAMES)
        monkeypatch.setattr(module, "build_command", lambda: "scripts/build")
    monkeypatch.setattr(kernels, "in_source_tree", lambda: True)


@pytest.mark.parametrize("name", [name for name in SUMMARIES if name != "doctor"])
def test_every_command_of_a_source_tree_notes_it_once(run, name):
    assert run(name, "--help").stderr == NOTE


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
    assert result.exit_code == 1
    (row,) = [line for line in result.stdout.splitlines() if line.startswith("kernels")]
    assert row.endswith(f"; out of date: {', '.join(NAMES)}")
    assert result.stderr == f"fpmatch: error: {MENDED_BY}\n"
    document = json.loads(run("doctor", "--json").stdout)
    assert document["outdated_kernels"] == NAMES
    assert document["problems"] == [MENDED_BY]


def test_the_version_says_how_many(run):
    count = len(kernels.compiled_kernels())
    text = f"5 of {count} kernels out of date: `scripts/build` compiles them"
    assert run("--version").output == f"fpmatch {fpmatch.__version__} ({text})\n"


def test_no_baseline_is_compared_with_them(run, prints, tmp_path):
    scores = tmp_path / "scores.csv"
    scores.write_text("probe,reference,score\n1_1,1_2,50\n1_1,2_1,1\n2_1,2_2,60\n1_2,2_2,2\n")
    result = run("evaluate", prints, "--baseline", scores)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"{NOTE}fpmatch: error: --baseline: kernels are out of date")
    assert "`scripts/build`" in result.stderr.removeprefix(NOTE)
    given = run("evaluate", "--scores-in", scores, "--baseline", scores, "--bootstrap", 0)
    assert given.exit_code == 0, given.stderr


def test_commands_of_research_note_it(run_research, tmp_path):
    result = run_research("fuzz", "--list")
    assert result.exit_code == 0
    assert result.stderr == NOTE


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="the kernels are not compiled")
def test_a_kernel_that_is_edited_is_noted_until_it_is_as_before(prints, tmp_path):
    """As a user edits it: the whole package in a source tree, in a process of its own."""
    package = tmp_path / "fpmatch"
    shutil.copytree(Path(fpmatch.__file__).parent, package)
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "build").touch()
    kernel = package / "matching" / "pipeline" / "_kernels" / "_alignment_kernel.py"
    as_before = kernel.read_bytes()
    words = ["verify", *[str(prints / name) for name in ("1_1.png", "2_1.png")]]

    def stderr():
        environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
        command = [sys.executable, "-m", "fpmatch", *words]
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        ).stderr

    assert stderr() == ""
    kernel.write_bytes(as_before.replace(b"1.06", b"1.07"))
    os.utime(kernel, (0, 0))
    note = stderr()
    name = "fpmatch.matching.pipeline._kernels._alignment_kernel"
    assert note.startswith(f"fpmatch: note: kernels out of date: {name}; ")
    assert note.count("\n") == 1
    kernel.write_bytes(as_before)
    assert stderr() == ""

"""What commands say where kernels are out of date; tests/test_kernels.py edits one."""

import importlib
import json

import pytest
from click.testing import CliRunner

from fpmatch.base import kernels
from fpmatch.cli import doctor as installation
from research.commands import Command

NAMES = [f"fpmatch._{letter}_kernel" for letter in "abcde"]
NOTE = "fpmatch: note: 5 of "


@pytest.fixture(autouse=True)
def outdated(monkeypatch):
    """Let five kernels be out of date."""
    evaluate = importlib.import_module("fpmatch.lab.cli.evaluate")
    for module in (kernels, installation, evaluate):
        monkeypatch.setattr(module, "outdated_kernels", lambda: NAMES)


def test_a_command_notes_it_once_and_its_result_is_as_it_was(run, prints):
    result = run("verify", prints / "1_1.png", prints / "1_1.png", "--json")
    assert result.exit_code == 0
    assert result.stderr.startswith(NOTE)
    assert result.stderr.count("\n") == 1
    assert json.loads(result.stdout)["match"] is True


def test_doctor_and_the_version_name_them(run):
    result = run("doctor")
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    (row,) = [line for line in result.stdout.splitlines() if line.startswith("kernels")]
    assert row.endswith(", ".join(NAMES))
    document = json.loads(run("doctor", "--json").stdout)
    assert document["outdated_kernels"] == NAMES
    assert result.stderr == f"fpmatch: error: {document['problems'][0]}\n"
    assert f"(5 of {len(kernels.compiled_kernels())} kernels " in run("--version").output


def test_no_baseline_is_compared_with_them(run, prints, tmp_path):
    scores = tmp_path / "scores.csv"
    scores.write_text("probe,reference,score\n1_1,1_2,50\n1_1,2_1,1\n2_1,2_2,60\n1_2,2_2,2\n")
    result = run("evaluate", prints, "--baseline", scores)
    assert (result.exit_code, result.stdout) == (2, "")
    note, error = result.stderr.splitlines()
    assert note.startswith(NOTE)
    assert "--baseline" in error
    assert run("rates", scores, "--baseline", scores, "--bootstrap", 0).exit_code == 0


def test_commands_of_research_note_it():
    result = CliRunner().invoke(Command("measure", callback=lambda: None))
    assert (result.exit_code, result.stderr.startswith(NOTE)) == (0, True)

"""Notes of commands that kernels are not compiled, or out of date."""

import importlib
import json

import pytest
from click.testing import CliRunner

from fpmatch.base import kernels
from fpmatch.base.kernels import slow_kernels_note
from fpmatch.cli import doctor as installation
from research.commands import Command
from tests.conftest import copied

NAMES = [f"fpmatch._{letter}_kernel" for letter in "abcde"]
NOTE = "fpmatch: note: 5 kernels out of date"


@pytest.fixture
def outdated(monkeypatch):
    """Let five kernels be out of date."""
    evaluate = importlib.import_module("fpmatch.lab.cli.evaluate")
    for module in (kernels, installation, evaluate):
        monkeypatch.setattr(module, "outdated_kernels", lambda: NAMES)


@pytest.mark.usefixtures("outdated")
def test_a_command_notes_outdated_kernels_once_and_its_result_is_as_it_was(run, prints):
    result = run("verify", prints / "1_1.png", prints / "1_1.png", "--json")
    assert (result.exit_code, result.stderr.count("\n")) == (0, 1)
    assert result.stderr.startswith(NOTE)
    assert json.loads(result.stdout)["match"] is True
    of_research = CliRunner().invoke(Command("measure", callback=lambda: None))
    assert (of_research.exit_code, of_research.stderr.startswith(NOTE)) == (0, True)


@pytest.mark.usefixtures("outdated")
def test_doctor_names_them(run):
    result = run("doctor")
    (row,) = [line for line in result.stdout.splitlines() if line.startswith("kernels")]
    assert row.endswith(", ".join(NAMES))
    document = json.loads(run("doctor", "--json").stdout)
    assert document["outdated_kernels"] == NAMES
    note, problem = result.stderr.splitlines()
    assert (result.exit_code, problem) == (1, f"fpmatch: error: {document['problems'][0]}")
    assert note.startswith(NOTE)


@pytest.mark.usefixtures("outdated")
def test_no_baseline_is_compared_with_them(run, prints, tmp_path):
    scores = tmp_path / "scores.csv"
    scores.write_text("probe,reference,score\n1_1,1_2,50\n1_1,2_1,1\n2_1,2_2,60\n1_2,2_2,2\n")
    result = run("evaluate", prints, "--baseline", scores)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "--baseline" in result.stderr.splitlines()[-1]
    assert run("rates", scores, "--baseline", scores, "--bootstrap", 0).exit_code == 0


@pytest.fixture
def some_interpreted(monkeypatch):
    """Let two of three kernels be not compiled, and commands note it."""
    found = dict(zip("abc", (True, False, False), strict=True))
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: found)
    monkeypatch.setattr(kernels, "slow_kernels_note", slow_kernels_note)


@pytest.mark.usefixtures("some_interpreted")
@pytest.mark.parametrize(
    "words",
    [
        "extract {set}/1_1.png {set}/2_1.png -o {new}",
        "enrol {new}.db {set}",
        "identify {gallery} {set}/1_1.png",
        "evaluate {set} --bootstrap 0 --workers 1",
        "score --references {set} --probes {set} -o {new}.csv --workers 1",
    ],
)
def test_batches_note_it_first(run, prints, gallery, tmp_path, words):
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png", "2_1.png")
    given = words.format(set=folder, gallery=gallery, new=tmp_path / "new").split()
    result = run(*given, "--json")
    assert result.exit_code == 0, result.stderr
    assert result.stderr.startswith("fpmatch: note: 2 of 3 kernels are not compiled")
    assert result.stderr.count("kernels") == 1
    assert "kernels" not in json.loads(result.stdout)


@pytest.mark.usefixtures("some_interpreted")
def test_two_prints_take_no_note(run, prints):
    assert "kernels" not in run("verify", prints / "1_1.png", prints / "1_2.png").stderr

"""`fpmatch calibrate`: a file that verify accepts, and how far its data reach."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import pytest

from fpmatch.evaluation import impostors
from fpmatch.matching.calibration import load_calibration

from .conftest import assert_refused

EVALUATION_TESTS = Path(__file__).parents[1] / "evaluation"


@pytest.fixture
def known_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the command run with a matcher and an extractor whose answers are known."""
    monkeypatch.syspath_prepend(str(EVALUATION_TESTS))
    fake_bench = importlib.import_module("fake_bench")
    monkeypatch.setattr(impostors, "get_matcher", lambda name: fake_bench.MATCHER)
    known = impostors.evaluate

    def evaluate(folders: Any, **options: Any) -> Any:
        return known(folders, **{**options, "extractor": fake_bench.extractor})

    monkeypatch.setattr(impostors, "evaluate", evaluate)


@pytest.fixture
def database(tmp_path: Path) -> Path:
    folder = tmp_path / "ours"
    folder.mkdir()
    for finger in range(1, 11):
        for number in range(1, 6):
            (folder / f"{finger}_{number}.tif").write_text("print")
    return folder


@pytest.mark.usefixtures("known_answers")
def test_the_file_is_a_calibration_and_the_reach_is_told(
    run: Any, database: Path, tmp_path: Path
) -> None:
    output = tmp_path / "calibration.json"
    result = run("calibrate", database, "-o", output, "--matcher", "fake", "--workers", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    calibration = load_calibration("fake", output)
    assert calibration.provenance.impostors == 1125
    assert calibration.provenance.fingers == 10
    first, *lines = result.stdout.splitlines()
    assert first == str(output)
    assert any(line.startswith("  Measured    up to score 17.5, ") for line in lines)
    assert any("extrapolated" in line for line in lines)
    as_json = run("calibrate", database, "-o", output, "--matcher", "fake", "--json")
    assert json.loads(as_json.stdout)["largest_measured_score"] == pytest.approx(
        calibration.largest_measured_score
    )


def test_too_few_comparisons_leave_no_file(run: Any, tmp_path: Path) -> None:
    scores, output = tmp_path / "scores.csv", tmp_path / "calibration.json"
    scores.write_text("set,probe,reference,genuine,similarity\na,1_1,2_1,0,0.5\n")
    result = run("calibrate", scores, "-o", output)
    assert_refused(result, "1 impostor comparisons are too few")
    assert not output.exists()


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["{root}/nowhere", "-o", "{root}/c.json"], "nowhere: no such folder"),
        (["{root}/notes.txt", "-o", "{root}/c.json"], "notes.txt: not a file of scores"),
        (["{root}", "-o", "{root}/c.json"], "holds no prints named"),
        (["{root}", "-o", "{root}/no/c.json"], "c.json: cannot be written"),
        (["{root}", "-o", "{root}"], "is a folder"),
        (["{root}", "-o", "{root}/c.json", "--matcher", "nobody"], "unknown matcher 'nobody'"),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    run: Any, tmp_path: Path, words: list[str], reason: str
) -> None:
    (tmp_path / "notes.txt").write_text("x\n")
    result = run("calibrate", *(word.format(root=tmp_path) for word in words))
    assert_refused(result, reason)

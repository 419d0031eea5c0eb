import importlib
import json

import pytest

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.lab.evaluation import calibrate
from fpmatch.lab.evaluation.databases.extraction import Reading
from fpmatch.matching.calibration import load_calibration
from research.templates.making import make_templates


@pytest.fixture
def known_answers(monkeypatch, bench):
    """Let the command run with a matcher and an extractor whose answers are known."""
    known = calibrate.evaluate_matchers
    command = importlib.import_module("fpmatch.lab.cli.calibrate")
    monkeypatch.setattr(command, "get_matcher", lambda name: bench.MATCHER)

    def evaluate(*given, **options):
        return known(*given, **{**options, "reading": Reading(extractor=bench.extractor)})

    monkeypatch.setattr(calibrate, "evaluate_matchers", evaluate)


@pytest.mark.usefixtures("known_answers")
def test_the_file_is_a_calibration_and_the_reach_is_told(run, make_database, tmp_path):
    database = make_database(fingers=10, impressions=5)
    output = tmp_path / "calibration.json"
    result = run("calibrate", database, "-o", output, "--matcher", "fake", "--workers", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    calibration = load_calibration("fake", output)
    assert calibration.provenance.impostors == 1125
    assert calibration.provenance.fingers == 10
    first, *lines = result.stdout.splitlines()
    assert first == str(output)
    assert any(line.startswith("  Measured ") and " 17.5, " in line for line in lines)
    as_json = run("calibrate", database, "-o", output, "--matcher", "fake", "--json")
    assert json.loads(as_json.stdout)["largest_measured_score"] == pytest.approx(
        calibration.largest_measured_score
    )


@pytest.mark.slow
def test_scores_of_the_default_matcher_are_refused_with_the_reason_and_the_command(run, tmp_path):
    """The command that the reason names makes a file that is taken: as the prints are."""
    prints = tmp_path / "prints.db"
    with open_gallery(prints, create=True) as gallery:
        templates = make_templates(0, range(17), 3)
        gallery.add(
            [
                NewEntry(Label(str(k // 3), impression=str(k % 3)), f"{k}", bytes([k]), template)
                for k, template in enumerate(templates)
            ]
        )
    scores, output = tmp_path / "scores.csv", tmp_path / "c.json"
    options = ["--scores", scores, "--bootstrap", 0]
    assert run("evaluate", prints, *options).exit_code == 0
    refused = run("calibrate", scores, "-o", output)
    assert (refused.exit_code, refused.stdout, output.exists()) == (2, "", False)
    assert refused.stderr.startswith(f"fpmatch: error: {scores}: the highest similarities of unit-")
    named = refused.stderr.strip().rpartition("fpmatch evaluate ")[2].split()
    assert named == ["--matcher", "unit-circle:beyond_share=0"]
    assert run("evaluate", prints, *options, *named).exit_code == 0
    calibrations = []
    for source in (scores, prints):
        done = run("calibrate", source, "-o", output)
        assert done.exit_code == 0, done.stderr
        calibrations.append(output.read_bytes())
    assert calibrations[0] == calibrations[1]

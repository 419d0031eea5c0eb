import json

from fpmatch import save_template
from fpmatch.matching.calibration import load_calibration
from research.templates.making import make_templates


def test_scores_of_the_default_matcher_are_refused_with_the_reason_and_the_command(run, tmp_path):
    """The command that the reason names makes a file that is taken: as the prints are."""
    prints = tmp_path / "prints"
    prints.mkdir()
    for k, template in enumerate(make_templates(0, range(17), 3)):
        save_template(prints / f"{k // 3}_{k % 3}.json", template)
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
        assert done.stdout.startswith(f"{output}\n  Matcher     unit-circle\n")
        calibrations.append(output.read_bytes())
    assert calibrations[0] == calibrations[1]
    report = json.loads(run("calibrate", scores, "-o", output, "--json").stdout)
    calibration = load_calibration("unit-circle", output)
    assert report["largest_measured_score"] == calibration.largest_measured_score
    assert report["impostors"] == calibration.provenance["impostors"]

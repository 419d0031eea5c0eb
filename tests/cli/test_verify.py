"""`fpmatch verify`: decisions, their words, their files, bad input."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch import assess, fmr_to_score
from fpmatch.matching.calibration import Calibration
from fpmatch.prints.reading import ASSUMED_DPI
from tests.conftest import assert_refused

SAMPLES = Path(__file__).parents[2] / "sample_data"

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "results.md"
TABLE = PAGE.read_text(encoding="utf-8").split("## verify")[1].split("`compared` has")[0]
FIELDS = [row.split("|")[1] for row in TABLE.splitlines() if row.startswith("| `")]
KEYS = [key for cell in FIELDS for key in re.findall(r"`(\w+)`", cell)]


def decision(result):
    return json.loads(result.stdout)


def test_a_turned_print_matches_and_the_turn_is_told(run, prints):
    probe, reference = prints / "1_2.png", prints / "1_1.png"
    result = run("verify", probe, reference, "--json")
    document = decision(result)
    assert (result.exit_code, result.stderr) == (0, "")
    assert list(document) == KEYS
    assert document["match"] is True
    assert document["score"] >= document["threshold"] == 40
    assert document["fmr"] == pytest.approx(10 ** (-document["score"] / 10))
    assert document["pairs"] >= 12
    # rot90 turns counter-clockwise on screen: back is +90°, and (0, 299) is where (279, 0) went.
    transform = document["transform"]
    assert transform["rotation_deg"] == pytest.approx(90, abs=1)
    assert transform["scale"] == pytest.approx(1, abs=0.02)
    assert (transform["tx"], transform["ty"]) == pytest.approx((279, 0), abs=4)
    assert 0 <= document["rms_px"] < 4
    assert document["reason"] == ""
    assert (document["probe"], document["reference"]) == (str(probe), str(reference))


def test_different_fingers_do_not_match_and_it_says_why(run, prints):
    words = ("verify", prints / "1_1.png", prints / "2_1.png", "--json")
    result = run(*words)
    document = decision(result)
    assert (result.exit_code, list(document)) == (1, KEYS)
    assert document["match"] is False
    assert document["score"] < 40
    assert document["reason"]
    lax = decision(run(*words, "--threshold", 0))
    assert (lax["match"], lax["threshold"]) == (True, 0)
    assert decision(run(*words, "--fmr", 0.001))["threshold"] == fmr_to_score(0.001)


def test_the_quality_of_images_is_part_of_why_not(run, prints):
    pair = prints / "1_1.png", prints / "blank.png"
    result = run("verify", *pair)
    assert result.exit_code == 3
    verdict, *lines = result.stdout.splitlines()
    assert verdict == "INCONCLUSIVE: no ridges"
    score = assess(prints / "1_1.png").quality.score
    shown = [line for line in lines if line.split()[0] in {"Missing", "Quality"}]
    assert [line.split()[0] for line in shown] == ["Missing", "Quality", "Quality"]
    assert f"probe: quality {score}" in shown[1]
    quality = decision(run("verify", *pair, "--json"))["quality"]
    assert quality["probe"]["score"] == score
    assert [reason["code"] for reason in quality["reference"]["reasons"]] == ["no ridges"]


def test_a_calibration_file_says_what_similarities_are_worth(run, prints, tmp_path):
    file = tmp_path / "calibration.json"
    made_for = {"matcher": "unit-circle"}
    calibration = Calibration(((0.0, 0.0), (0.5, 1.0)), tail_scale=1e9, provenance=made_for)
    file.write_text(calibration.as_json())
    words = ("verify", prints / "1_1.png", prints / "1_2.png", "--calibration", file)
    document = decision(run(*words, "--json"))
    assert (document["match"], document["extrapolated"]) == (False, True)
    assert document["score"] == pytest.approx(1.0, abs=0.01)
    text = run(*words).stdout
    assert ("1 in 1.3" in text, "extrapolated" in text) == (True, True)
    assert_refused(run(*words, "--matcher", "paper"), f"{file}: ")


def test_rho_or_a_score_decides_for_the_papers_matcher(run, prints):
    one, other = prints / "1_1.png", prints / "2_1.png"
    result = run("verify", one, one, "--matcher", "paper", "--json")
    document = decision(result)
    assert (result.exit_code, list(document)) == (0, KEYS)
    assert (document["match"], document["matched_share"], document["rho"]) == (True, 1.0, 0.6)
    share = decision(run("verify", one, other, "--matcher", "paper", "--json"))["matched_share"]
    assert 0 < share < 0.6
    for rho, status in ((share, 1), (share - 1e-9, 0)):
        words = ("verify", one, other, "--matcher", f"paper:rho={rho!r}", "--json")
        assert run(*words).exit_code == status
    by_score = decision(run("verify", one, one, "--matcher", "paper", "--threshold", 40, "--json"))
    assert (by_score["match"], by_score["rho"], by_score["threshold"]) == (False, None, 40)


def test_with_other_parameters_there_is_no_score(run, prints):
    words = ["verify", prints / "1_1.png", prints / "1_1.png", "--json", "--matcher"]
    document = decision(run(*words, "paper:area_tolerance=0.01"))
    assert (document["matcher"], document["score"]) == ("paper:area_tolerance=0.01", None)
    assert decision(run(*words, "paper:area_tolerance=0.1"))["matcher"] == "paper"
    assert_refused(run(*words, "unit-circle:rounds=2"), "no calibration")


def test_notes_on_the_resolution(run, prints):
    path, untagged = prints / "1_1.png", prints / "untagged.tif"
    result = run("verify", untagged, untagged)
    assert (result.exit_code, result.stderr.count(ASSUMED_DPI)) == (0, 1)
    for given in (["--dpi", "500"], ["--probe-dpi", "500", "--reference-dpi", "500"]):
        assert run("verify", untagged, untagged, *given).stderr == ""
    wrong = run("verify", path, path, "--dpi", 750)
    assert wrong.stderr.startswith(f"fpmatch: note: {path}: wrong resolution: ")


def test_overlay_writes_a_picture_whatever_the_decision(run, prints, tmp_path):
    drawn, picture = [], tmp_path / "overlay.png"
    for name, status, view in (
        ("1_2.png", 0, "overlay"),
        ("1_2.png", 0, "side-by-side"),
        ("blank.png", 3, "ridges"),
    ):
        pair = prints / name, prints / "1_1.png"
        result = run("verify", *pair, "--overlay", picture, "--view", view)
        assert (result.exit_code, "no transform" in result.stderr) == (status, name == "blank.png")
        with Image.open(picture) as opened:
            assert opened.width > 280
        drawn.append(picture.read_bytes())
    assert len({*drawn}) == 3


def test_a_claimed_identity_is_checked_against_all_its_impressions(run, gallery, prints):
    words = ("verify", "--gallery", gallery, prints / "1_1.png", "--subject")
    result = run(*words, 1)
    assert (result.exit_code, result.stderr) == (0, "")
    verdict, finger, *_ = result.stdout.splitlines()
    assert (verdict, finger.split()[1:3]) == ("MATCH, identical templates", ["2", "impressions"])
    assert_refused(run(*words, 7), "subject 7")
    other = run(*words, 2, "--json")
    assert (other.exit_code, other.stderr) == (1, "")
    document = decision(other)
    assert (document["match"], document["subject"], document["impressions"]) == (False, "2", 1)
    assert (document["best"]["impression"], document["gallery"]) == ("1", str(gallery))


@pytest.mark.docs
def test_the_reference_lists_every_field_of_the_json(run):
    page = (SAMPLES.parent / "docs" / "reference" / "results.md").read_text(encoding="utf-8")
    of_verify = page.split("\n## ")[1].splitlines()
    rows = [line.split("|")[1] for line in of_verify if line.startswith("| `")]
    listed = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    pair = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"
    document = decision(run("verify", *pair, "--json"))
    assert listed == document.keys() | document["compared"].keys()


@pytest.mark.parametrize("output", ["--overlay a.png --json", "--case-report a.html"])
def test_a_full_disk_does_not_cost_the_decision(run, prints, tiny_disk, monkeypatch, output):
    (tiny_disk / "fill").write_bytes(bytes(56_000))
    monkeypatch.chdir(tiny_disk)
    words = ("verify", prints / "1_1.png", prints / "1_2.png", *output.split())
    result = run(*words)
    assert result.exit_code == 2
    assert result.stdout.startswith("{" if "--json" in words else "MATCH")
    assert (
        result.stderr == f"fpmatch: error: {words[4]}: cannot be written: no space left on device\n"
    )
    assert [path.name for path in tiny_disk.iterdir()] == ["fill"]


def test_a_mirrored_print_is_no_match_and_is_named(run, tmp_path):
    pixels = np.asarray(Image.open(SAMPLES / "101_1.tif").convert("L"))
    probe, reference = tmp_path / "mirrored.png", SAMPLES / "101_3.tif"
    Image.fromarray(pixels[:, ::-1]).save(probe, dpi=(500, 500))
    run("extract", probe, "-o", tmp_path)
    for one in (probe, tmp_path / "mirrored.json"):
        result = run("verify", one, reference)
        assert (result.exit_code, result.stdout.split("\n")[0]) == (1, "NO MATCH")
        (score,) = re.findall("the probe matches, with a score of ([0-9.]+)", result.stdout)
        turned = run("verify", one, reference, "--mirror", "--json")
        assert (turned.exit_code, "left and right are exchanged" in turned.stderr) == (0, True)
    paid = 10 * np.log10(2)  # one of two tries has half of the rate
    assert decision(turned)["score"] - paid == pytest.approx(float(score), abs=0.1)

"""`fpmatch verify` and `fpmatch overlay`: decisions, their words, their files, bad input."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch import assess, fmr_to_score
from fpmatch.matching.calibration import Calibration, Provenance
from fpmatch.prints.reading import ASSUMED_DPI

from .conftest import assert_refused

SAMPLES = Path(__file__).parents[2] / "sample_data"

KEYS = [
    "decision", "match", "score", "fmr", "extrapolated", "threshold", "matched_share", "rho",
    "pairs", "transform", "rms_px", "compared", "scale", "missing", "reachable_score", "identical",
    "reason", "quality", "probe", "reference",
]  # fmt: skip


def decision(result):
    """Return the one JSON object that a command printed."""
    return json.loads(result.stdout)


def test_a_turned_print_matches_and_the_turn_is_told(run, prints):
    probe, reference = prints / "1_2.png", prints / "1_1.png"
    result = run("verify", probe, reference, "--json")
    found = decision(result)
    assert (result.exit_code, result.stderr) == (0, "")
    assert list(found) == KEYS
    assert found["match"] is True
    assert found["score"] >= found["threshold"] == 40
    assert found["fmr"] == pytest.approx(10 ** (-found["score"] / 10))
    assert found["pairs"] >= 12
    # rot90 turns counter-clockwise on screen: back is +90°, and (0, 299) is where (279, 0) went.
    transform = found["transform"]
    assert transform["rotation_deg"] == pytest.approx(90, abs=1)
    assert transform["scale"] == pytest.approx(1, abs=0.02)
    assert (transform["tx"], transform["ty"]) == pytest.approx((279, 0), abs=4)
    assert 0 <= found["rms_px"] < 4
    assert found["reason"] == ""
    assert (found["probe"], found["reference"]) == (str(probe), str(reference))


def test_two_copies_of_one_print_are_called_identical(run, prints, tmp_path):
    original, copy = prints / "1_1.png", tmp_path / "copy.bmp"
    Image.open(original).save(copy, dpi=(500, 500))
    assert original.read_bytes() != copy.read_bytes()
    result = run("verify", original, copy)
    assert result.stdout.splitlines()[:2] == [
        "MATCH",
        "  Identical   the two images have the same pixels: an impression is compared with itself",
    ]
    assert decision(run("verify", original, copy, "--json"))["identical"] == "pixels"
    assert run("extract", original, "-o", tmp_path / "templates").exit_code == 0
    template = tmp_path / "templates" / "1_1.json"
    for probe, reference in ((template, template), (copy, template)):
        found = decision(run("verify", probe, reference, "--json"))
        assert (found["match"], found["identical"]) == (True, "template")
    for other in ("1_2.png", "2_1.png"):
        found = decision(run("verify", original, prints / other, "--json"))
        assert found["identical"] is None
    drawn = run("overlay", original, copy, "-o", tmp_path / "overlay.png")
    assert drawn.stderr == "fpmatch: note: the two images have the same pixels\n"


def test_a_claim_with_the_enrolled_file_is_called_identical(run, gallery, prints):
    words = ("verify", "--gallery", gallery, "--subject", 1)
    assert decision(run(*words, prints / "1_1.png", "--json"))["identical"] == "template"
    text = run(*words, prints / "1_1.png").stdout
    assert "Identical   the two templates are the same" in text
    other = ("verify", "--gallery", gallery, "--subject", 2, prints / "1_1.png", "--json")
    assert decision(run(*other))["identical"] is None


def test_different_fingers_do_not_match_and_it_says_why(run, prints):
    result = run("verify", prints / "1_1.png", prints / "2_1.png", "--json")
    found = decision(result)
    assert result.exit_code == 1
    assert list(found) == KEYS
    assert found["match"] is False
    assert found["score"] < 40
    assert found["reason"]
    words = ("verify", prints / "1_1.png", prints / "2_1.png", "--json")
    lax = decision(run(*words, "--threshold", 0))
    assert (lax["match"], lax["threshold"]) == (True, 0)
    assert decision(run(*words, "--fmr", 0.001))["threshold"] == fmr_to_score(0.001)


def test_the_quality_of_images_is_part_of_why_not(run, prints):
    pair = prints / "1_1.png", prints / "blank.png"
    result = run("verify", *pair)
    assert result.exit_code == 3
    assert result.stdout.startswith("INCONCLUSIVE: no ridges\n")
    assert "\n  Missing     the reference has no ridges\n" in result.stdout
    probe, reference = (line for line in result.stdout.splitlines() if "  Quality " in line)
    score = assess(prints / "1_1.png").quality.score
    assert probe == f"  Quality     probe: quality {score}"
    assert reference.startswith("  Quality     reference: quality 0; no ridges: ")
    quality = decision(run("verify", *pair, "--json"))["quality"]
    assert quality["probe"]["score"] == score
    assert [reason["code"] for reason in quality["reference"]["reasons"]] == ["no ridges"]


def test_a_resolution_that_the_ridges_belie_is_said_of_a_match_too(run, prints):
    path = prints / "1_1.png"
    result = run("verify", path, path, "--dpi", 750)
    assert result.exit_code == 0
    assert result.stderr.startswith(f"fpmatch: note: {path}: wrong resolution: ridges lie ")
    assert "probably not 750 dpi but about " in result.stderr


@pytest.mark.parametrize("name", ["blank.png", "noise.png"])
def test_a_picture_without_a_print_is_no_match_even_with_itself(run, prints, name):
    assert decision(run("verify", prints / name, prints / name, "--json"))["match"] is False


def test_a_calibration_file_says_what_similarities_are_worth(run, prints, tmp_path):
    file = tmp_path / "calibration.json"
    made_for = Provenance(matcher="unit-circle")
    calibration = Calibration(((0.0, 0.0), (0.5, 1.0)), tail_scale=1e9, provenance=made_for)
    file.write_text(calibration.as_json())
    words = ("verify", prints / "1_1.png", prints / "1_2.png", "--calibration", file)
    found = decision(run(*words, "--json"))
    assert (found["match"], found["extrapolated"]) == (False, True)
    assert found["score"] == pytest.approx(1.0, abs=0.01)
    assert "measured up to 1 in 1.3" in run(*words).stdout
    other = run(*words, "--matcher", "paper")
    assert_refused(other, f"{file}: calibrates matcher 'unit-circle', not 'paper'")


def test_a_print_matches_itself_by_the_papers_matcher(run, prints, tmp_path):
    pair = prints / "1_1.png", prints / "1_1.png", "--matcher", "paper"
    result = run("verify", *pair, "--json")
    found = decision(result)
    assert result.exit_code == 0
    assert list(found) == KEYS
    assert (found["match"], found["matched_share"], found["rho"]) == (True, 1.0, 0.6)
    assert found["threshold"] < found["score"] < 40
    words = run("verify", *pair).stdout
    assert "\n  Matched     100.0% of the minutiae of the smaller print are " in words
    assert "a match needs more than 0.6 of them (rho)" in words
    assert re.search(r"Score +\d+\.\d on a scale to 100; it does not decide here", words)
    drawn = run("overlay", *pair, "-o", tmp_path / "overlay.svg", "--rho", 1)
    assert drawn.stdout.startswith("NO MATCH, score ")


@pytest.mark.parametrize(("name", "status"), [("2_1.png", 1), ("blank.png", 3)])
def test_different_fingers_do_not_match_by_the_papers_matcher(run, prints, name, status):
    result = run("verify", prints / "1_1.png", prints / name, "--matcher", "paper", "--json")
    found = decision(result)
    assert (result.exit_code, found["match"], found["scale"]) == (status, False, None)
    assert found["reason"]


def test_rho_or_a_score_decides_for_the_papers_matcher(run, prints):
    words = ["verify", prints / "1_1.png", prints / "2_1.png", "--matcher", "paper"]
    share = decision(run(*words, "--json"))["matched_share"]
    assert 0 < share < 0.6
    assert run(*words, "--rho", repr(share)).exit_code == 1
    assert run(*words, "--rho", repr(share - 1e-9)).exit_code == 0
    words[2] = words[1]
    found = decision(run(*words, "--threshold", 40, "--json"))
    assert (found["match"], found["rho"], found["threshold"]) == (False, None, 40)
    assert run(*words, "--threshold", 20).exit_code == run(*words, "--fmr", 0.01).exit_code == 0


def test_another_area_tolerance_is_not_what_the_score_was_measured_at(run, prints):
    words = ["verify", prints / "1_1.png", prints / "1_1.png", "--matcher", "paper"]
    result = run(*words, "--area-tolerance", 0.01)
    assert result.exit_code == 0
    assert result.stderr == (
        "fpmatch: note: the score was calibrated at an area tolerance of 0.1, not 0.01\n"
    )
    assert run(*words, "--area-tolerance", 0.1).stderr == ""


def test_the_assumed_resolution_is_said_once(run, prints):
    words = ("verify", prints / "untagged.tif", prints / "untagged.tif")
    result = run(*words)
    assert result.exit_code == 0
    assert result.stderr == f"fpmatch: note: {words[1]}: {ASSUMED_DPI} (--dpi sets it)\n"
    for given in (["--dpi", "500"], ["--probe-dpi", "500", "--reference-dpi", "500"]):
        assert run(*words, *given).stderr == ""


def test_verify_writes_the_overlay_too(run, prints, tmp_path):
    for suffix in ("png", "svg"):
        picture = tmp_path / f"overlay.{suffix}"
        result = run("verify", prints / "1_1.png", prints / "1_2.png", "--overlay", picture)
        assert result.stdout.startswith("MATCH\n")
    assert np.asarray(Image.open(tmp_path / "overlay.png")).shape[2] == 3
    assert picture.read_text().lstrip().startswith(("<svg", "<?xml"))


def test_overlay_writes_a_picture_whatever_the_decision(run, prints, tmp_path):
    drawn = []
    for name, words, option in (
        ("1_2.png", "MATCH, score ", []),
        ("1_2.png", "MATCH, score ", ["--side-by-side"]),
        ("blank.png", "INCONCLUSIVE: no ridges, score ", []),
    ):
        picture = tmp_path / "overlay.png"
        result = run("overlay", prints / name, prints / "1_1.png", "-o", picture, *option)
        assert result.exit_code == 0
        assert result.stdout.startswith(words)
        assert result.stdout.endswith(f": {picture}\n")
        with Image.open(picture) as opened:
            assert opened.width > 280
        drawn.append(picture.read_bytes())
    assert drawn[0] != drawn[1]


def test_overlays_of_ridges_and_warped_ones(run, tmp_path):
    prints = [SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"]
    drawn = []
    for words in (
        ("overlay", "-o"),
        ("overlay", "--ridges", "-o"),
        ("overlay", "--view", "ridges", "-o"),
        ("verify", "--view", "ridges", "--overlay"),
        ("overlay", "--warp", "-o"),
        ("verify", "--warp", "--overlay"),
    ):
        picture = tmp_path / "drawn.svg"
        result = run(words[0], *prints, *words[1:], picture)
        assert (result.exit_code, result.stderr) == (0, "")
        drawn.append(picture.read_text())
    assert drawn[1] == drawn[2] == drawn[3] != drawn[0] != drawn[4] == drawn[5]
    assert "similarity transform" in drawn[0]
    assert "for looking, not for measuring" in drawn[4]


def test_what_cannot_be_drawn_is_noted(run, prints, tmp_path):
    picture = tmp_path / "drawn.png"
    for view, reason in (("--warp", "no transform was found"), ("--ridges", "no transform")):
        result = run("overlay", prints / "blank.png", prints / "1_1.png", view, "-o", picture)
        assert result.exit_code == 0
        assert f"fpmatch: note: {picture}: {reason}" in result.stderr


def test_the_map_of_ridges_is_in_the_json_if_requested(run, prints):
    pair = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"
    assert "ridge_map" not in decision(run("verify", *pair, "--json"))
    document = decision(run("verify", *pair, "--json", "--ridge-map"))
    found = document["ridge_map"]
    assert found["mean"] == pytest.approx(document["compared"]["ridge_agreement"], rel=1e-12)
    assert np.mean([value for _, _, value in found["cells"]]) == pytest.approx(
        found["mean"], abs=1e-4
    )
    blank = run("verify", prints / "blank.png", prints / "1_1.png", "--json", "--ridge-map")
    assert decision(blank)["ridge_map"] is None


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("overlay {a} {b} -o o.png --ridges --side-by-side", "exclude each other"),
        ("overlay {a} {b} -o o.png --ridges --view overlay", "exclude each other"),
        ("overlay {a} {b} -o o.png --ridges --warp", "--warp cannot be combined"),
        ("verify {a} {b} --view ridges", "--overlay"),
        ("verify {a} {b} --warp", "--overlay"),
        ("verify {a} {b} --ridge-map", "--json"),
        ("verify {a} --gallery g.db --subject 1 --ridge-map --json", "compare two files"),
    ],
)
def test_views_that_contradict_one_another_are_refused(run, prints, words, reason):
    sides = {"a": prints / "1_1.png", "b": prints / "1_2.png"}
    result = run(*(word.format(**sides) for word in words.split()))
    assert (result.exit_code, result.stdout) == (2, "")
    assert reason in result.stderr


def test_a_claimed_identity_is_checked_against_all_its_impressions(run, gallery, prints):
    words = ("verify", "--gallery", gallery, prints / "1_1.png", "--subject")
    result = run(*words, 1)
    assert (result.exit_code, result.stderr) == (0, "")
    verdict, finger, *_ = result.stdout.splitlines()
    assert verdict == "MATCH"
    assert "2 impressions of subject 1; the most similar is 1_1" in finger
    other = run(*words, 2, "--json")
    assert (other.exit_code, other.stderr) == (1, "")
    document = decision(other)
    assert (document["match"], document["subject"], document["impressions"]) == (False, "2", 1)
    assert document["best"]["impression"] == "1"
    assert document["gallery"] == str(gallery)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("--gallery {db} --subject 7 {print}", "no impression of subject 7"),
        ("--gallery {db} {print}", "--gallery and --subject must be given together"),
        ("--gallery {db} --subject 1 {print} {print}", "REFERENCE cannot be combined"),
        ("--gallery {db} --subject 1 --rho 0.6 {print}", "--rho cannot be combined"),
        ("--gallery {db} --subject 1 --overlay o.png {print}", "--overlay"),
        ("{print}", "Missing argument 'REFERENCE'"),
    ],
)
def test_a_claim_that_cannot_be_checked_is_refused(run, gallery, prints, words, reason):
    given = (word.format(db=gallery, print=prints / "1_1.png") for word in words.split())
    result = run("verify", *given)
    assert (result.exit_code, result.stdout) == (2, "")
    assert reason in result.stderr


@pytest.mark.docs
def test_the_reference_lists_every_field_of_the_json(run):
    page = (SAMPLES.parent / "docs" / "reference" / "result_json.md").read_text(encoding="utf-8")
    of_verify = page.split("\n## ")[0].splitlines()
    rows = [line.split("|")[1] for line in of_verify if line.startswith("| `")]
    listed = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    pair = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"
    document = decision(run("verify", *pair, "--json", "--ridge-map"))
    inner = document["compared"].keys() | document.pop("ridge_map").keys()
    assert listed == document.keys() | inner

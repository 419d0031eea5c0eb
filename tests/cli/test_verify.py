"""`fpmatch verify`: decisions, their words, their files, bad input."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch import assess, fmr_to_score
from fpmatch.matching.calibration import Calibration, Provenance
from fpmatch.prints.reading import ASSUMED_DPI
from tests.conftest import assert_refused

SAMPLES = Path(__file__).parents[2] / "sample_data"

KEYS = [
    "decision", "match", "score", "fmr", "extrapolated", "threshold", "matched_share", "rho",
    "matcher", "pairs", "transform", "rms_px", "compared", "scale", "missing", "reachable_score",
    "identical", "reason", "quality", "probe", "reference", "resolution",
]  # fmt: skip


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


def test_two_copies_of_one_print_are_called_identical(run, prints, tmp_path):
    original, copy = prints / "1_1.png", tmp_path / "copy.bmp"
    Image.open(original).save(copy, dpi=(500, 500))
    assert run("verify", original, copy).stdout.startswith("MATCH, identical images\n")
    assert run("extract", original, "-o", tmp_path / "templates").exit_code == 0
    template = tmp_path / "templates" / "1_1.json"
    for probe, reference, identical in (
        (original, copy, "pixels"),
        (template, template, "template"),
        (copy, template, "template"),
        (original, prints / "1_2.png", None),
    ):
        result = decision(run("verify", probe, reference, "--json"))
        assert (result["match"], result["identical"]) == (True, identical)
        assert (result["fmr"] is None) == (identical is not None)
    drawn = run("verify", original, copy, "--overlay", tmp_path / "overlay.png")
    assert "same pixels" in drawn.output
    assert "pairs of different fingers" not in drawn.output


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


def test_a_resolution_that_the_ridges_belie_is_said_of_a_match_too(run, prints):
    path = prints / "1_1.png"
    result = run("verify", path, path, "--dpi", 750)
    assert result.exit_code == 0
    assert result.stderr.startswith(f"fpmatch: note: {path}: wrong resolution: ")


def test_a_calibration_file_says_what_similarities_are_worth(run, prints, tmp_path):
    file = tmp_path / "calibration.json"
    made_for = Provenance(matcher="unit-circle")
    calibration = Calibration(((0.0, 0.0), (0.5, 1.0)), tail_scale=1e9, provenance=made_for)
    file.write_text(calibration.as_json())
    words = ("verify", prints / "1_1.png", prints / "1_2.png", "--calibration", file)
    document = decision(run(*words, "--json"))
    assert (document["match"], document["extrapolated"]) == (False, True)
    assert document["score"] == pytest.approx(1.0, abs=0.01)
    assert "1 in 1.3" in run(*words).stdout
    assert_refused(run(*words, "--matcher", "paper"), f"{file}: ")


def test_a_print_matches_itself_by_the_papers_matcher(run, prints, tmp_path):
    pair = prints / "1_1.png", prints / "1_1.png", "--matcher", "paper"
    result = run("verify", *pair, "--json")
    document = decision(result)
    assert (result.exit_code, list(document)) == (0, KEYS)
    assert (document["match"], document["matched_share"], document["rho"]) == (True, 1.0, 0.6)
    assert document["threshold"] < document["score"] < 40
    assert re.search(r"\n  Matched +100.0% .* more than 0.6 .*\(rho\)", run("verify", *pair).stdout)
    drawn = run("verify", *pair[:-1], "paper:rho=1", "--overlay", tmp_path / "overlay.svg")
    assert drawn.stdout.startswith("NO MATCH")
    assert (tmp_path / "overlay.svg").stat().st_size > 5000


@pytest.mark.parametrize(("name", "status"), [("2_1.png", 1), ("blank.png", 3)])
def test_different_fingers_do_not_match_by_the_papers_matcher(run, prints, name, status):
    result = run("verify", prints / "1_1.png", prints / name, "--matcher", "paper", "--json")
    found = decision(result)
    assert (result.exit_code, found["match"], found["scale"]) == (status, False, None)
    assert found["reason"]


def test_rho_or_a_score_decides_for_the_papers_matcher(run, prints):
    words = ["verify", "--matcher", "paper", prints / "1_1.png", prints / "2_1.png"]
    share = decision(run(*words, "--json"))["matched_share"]
    assert 0 < share < 0.6
    words[2] = f"paper:rho={share!r}"
    assert run(*words).exit_code == 1
    words[2] = f"paper:rho={share - 1e-9!r}"
    result = run(*words, "--json")
    assert (result.exit_code, decision(result)["matcher"]) == (0, words[2])
    assert decision(result)["score"] is not None  # rho alters no similarity
    words[2:] = "paper", words[3], words[3]
    document = decision(run(*words, "--threshold", 40, "--json"))
    assert (document["match"], document["rho"], document["threshold"]) == (False, None, 40)
    assert run(*words, "--threshold", 20).exit_code == run(*words, "--fmr", 0.01).exit_code == 0


def test_with_other_parameters_there_is_no_score(run, prints):
    words = ["verify", prints / "1_1.png", prints / "1_1.png", "--json", "--matcher"]
    found = decision(run(*words, "paper:area_tolerance=0.01"))
    assert (found["matcher"], found["score"]) == ("paper:area_tolerance=0.01", None)
    assert decision(run(*words, "paper:area_tolerance=0.1"))["matcher"] == "paper"
    refused = run(*words, "unit-circle:rounds=2")
    assert_refused(
        refused, "matcher 'unit-circle:rounds=2' has no calibration (that of unit-circle"
    )


def test_the_assumed_resolution_is_said_once(run, prints):
    words = ("verify", prints / "untagged.tif", prints / "untagged.tif")
    result = run(*words)
    assert (result.exit_code, result.stderr.count(ASSUMED_DPI)) == (0, 1)
    for given in (["--dpi", "500"], ["--probe-dpi", "500", "--reference-dpi", "500"]):
        assert run(*words, *given).stderr == ""


def test_overlay_writes_a_picture_whatever_the_decision(run, prints, tmp_path):
    drawn, picture = [], tmp_path / "overlay.png"
    for name, status, word, option in (
        ("1_2.png", 0, "MATCH\n", []),
        ("1_2.png", 0, "MATCH\n", ["--view", "side-by-side"]),
        ("blank.png", 3, "INCONCLUSIVE: ", []),
    ):
        result = run("verify", prints / name, prints / "1_1.png", "--overlay", picture, *option)
        assert (result.exit_code, result.stdout.startswith(word)) == (status, True)
        with Image.open(picture) as opened:
            assert opened.width > 280
        drawn.append(picture.read_bytes())
    assert drawn[0] != drawn[1]


def test_what_cannot_be_drawn_is_noted(run, prints, tmp_path):
    picture = tmp_path / "drawn.png"
    pair = prints / "blank.png", prints / "1_1.png"
    result = run("verify", *pair, "--view", "ridges", "--overlay", picture)
    assert (result.exit_code, f"note: {picture}: no transform" in result.stderr) == (3, True)


def test_the_map_of_ridges_is_in_the_json_if_requested(run, prints):
    pair = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"
    assert "ridge_map" not in decision(run("verify", *pair, "--json"))
    document = decision(run("verify", *pair, "--json", "--ridge-map"))
    mean, cells = document["ridge_map"]["mean"], document["ridge_map"]["cells"]
    assert mean == pytest.approx(document["compared"]["ridge_agreement"], rel=1e-12)
    assert np.mean([value for _, _, value in cells]) == pytest.approx(mean, abs=1e-4)
    blank = run("verify", prints / "blank.png", prints / "1_1.png", "--json", "--ridge-map")
    assert decision(blank)["ridge_map"] is None


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("verify {a} {b} --view ridges", "--overlay"),
        ("verify {a} {b} --ridge-map", "--json"),
        ("verify {a} --gallery {db} --subject 1 --ridge-map --json", "--ridge-map"),
        ("verify --gallery {db} --subject 7 {a}", "subject 7"),
        ("verify --gallery {db} {a}", "--subject"),
        ("verify --gallery {db} --subject 1 {a} {a}", "REFERENCE"),
        ("verify --gallery {db} --subject 1 --matcher paper:rho=0.5 {a}", "rho"),
        ("verify --gallery {db} --subject 1 --overlay o.png {a}", "--overlay"),
        ("verify {a}", "REFERENCE"),
    ],
)
def test_options_that_contradict_one_another_are_refused(run, prints, gallery, words, reason):
    named = {"a": prints / "1_1.png", "b": prints / "1_2.png", "db": gallery}
    result = run(*(word.format(**named) for word in words.split()))
    assert (result.exit_code, result.stdout) == (2, "")
    assert reason in result.stderr


def test_a_claimed_identity_is_checked_against_all_its_impressions(run, gallery, prints):
    words = ("verify", "--gallery", gallery, prints / "1_1.png", "--subject")
    result = run(*words, 1)
    assert (result.exit_code, result.stderr) == (0, "")
    verdict, finger, *_ = result.stdout.splitlines()
    assert (verdict, finger.split()[1:3]) == ("MATCH, identical templates", ["2", "impressions"])
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
    document = decision(run("verify", *pair, "--json", "--ridge-map"))
    inner = document["compared"].keys() | document.pop("ridge_map").keys()
    assert listed == document.keys() | inner


OUTPUTS = [("--overlay", "a.png"), ("--overlay", "a.svg"), ("--case-report", "a.html")]


@pytest.mark.parametrize(
    ("option", "name", "reason"),
    [
        ("--overlay", "a.jpg", "a.jpg: an overlay is written as .png or .svg"),
        ("--case-report", "a.pdf", "a.pdf: a case report is written as .html or .htm"),
        ("--overlay", "file/a.png", "file/a.png: cannot be written: not a directory"),
        ("--case-report", "file/a.html", "file/a.html: cannot be written: not a directory"),
    ],
)
def test_an_output_that_cannot_be_written_is_found_before_the_work(
    run, prints, tmp_path, monkeypatch, option, name, reason
):
    (tmp_path / "file").touch()
    monkeypatch.setattr("fpmatch.cli.verify.compare_files", None)
    result = run("verify", prints / "1_1.png", prints / "1_2.png", option, tmp_path / name)
    assert_refused(result, reason)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("as_json", [False, True])
@pytest.mark.parametrize(("option", "name"), OUTPUTS)
def test_a_full_disk_does_not_cost_the_decision(run, prints, tiny_disk, option, name, as_json):
    (tiny_disk / "fill").write_bytes(bytes(56_000))
    words = ("verify", prints / "1_1.png", prints / "1_2.png", *["--json"] * as_json)
    result = run(*words, option, tiny_disk / name)
    assert result.exit_code == 2
    assert result.stdout == run(*words).stdout != ""
    line = f"{tiny_disk / name}: cannot be written: no space left on device"
    assert result.stderr == f"fpmatch: error: {line}\n"
    assert [path.name for path in tiny_disk.iterdir()] == ["fill"]


@pytest.fixture(scope="module")
def flipped(tmp_path_factory):
    """Return the files of a sample print, exchanged left and right, and top and bottom."""
    pixels = np.asarray(Image.open(SAMPLES / "101_1.tif").convert("L"))
    folder = tmp_path_factory.mktemp("flipped")
    for name, one in (("mirrored", pixels[:, ::-1]), ("bottom_up", pixels[::-1])):
        Image.fromarray(one).save(folder / f"{name}.png", dpi=(500, 500))
    return folder


@pytest.mark.parametrize("name", ["mirrored", "bottom_up"])
def test_a_mirrored_print_is_no_match_and_is_named(run, flipped, tmp_path, name):
    probe, reference = flipped / f"{name}.png", SAMPLES / "101_3.tif"
    run("extract", probe, "-o", tmp_path)
    for one in (probe, tmp_path / f"{name}.json"):
        result = run("verify", one, reference)
        assert (result.exit_code, result.stdout.split("\n")[0]) == (1, "NO MATCH")
        (score,) = re.findall("the probe matches, with a score of ([0-9.]+)", result.stdout)
        assert "--mirror" in result.stdout
        turned = run("verify", one, reference, "--mirror", "--json")
        assert (turned.exit_code, "left and right are exchanged" in turned.stderr) == (0, True)
        if one.suffix == ".json":  # one of two tries has half of the rate
            paid = 10 * np.log10(2)
            assert decision(turned)["score"] - paid == pytest.approx(float(score), abs=0.1)
        as_json = decision(run("verify", reference, one, "--json"))
        assert (as_json["match"], "mirrored, the probe" in as_json["reason"]) == (False, True)

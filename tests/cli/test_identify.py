from __future__ import annotations

import json
import shutil

import pytest

from fpmatch.engine.engine import serial
from fpmatch.gallery.enrol import enrol
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.prints import find_prints
from fpmatch.reading import ASSUMED_DPI

from .conftest import assert_refused


@pytest.fixture(scope="module")
def place(tmp_path_factory, prints):
    """Return a gallery of prints of two fingers, one of them twice."""
    folder = tmp_path_factory.mktemp("gallery")
    with open_gallery(folder / "prints.db", create=True) as gallery:
        files = find_prints(prints / name for name in ("1_1.png", "2_1.png", "1_2.png"))
        assert enrol(gallery, files, engine=serial()).enrolled == 3
    return folder / "prints.db"


def test_candidates_in_words(run, place, prints):
    words = ("identify", place, prints / "1_1.png", "-k", 2, "--transform", "--workers", 1)
    result = run(*words, "--impressions")
    assert (result.exit_code, result.stderr) == (0, "")
    head, columns, first, first_moved, second, _, note = result.stdout.splitlines()
    assert head.startswith(f"{prints}/1_1.png: 3 prints compared in ")
    assert columns.split() == ["rank", "score", "FMR", "by", "chance", "print", "number", "picture"]
    assert first.split()[0] == "1"
    assert float(first.split()[1]) > 60
    assert first.split()[-3:] == ["1_1", "1", f"{prints}/1_1.png"]
    assert first_moved.strip().startswith("rotation 0.0°")
    assert second.split()[-3] == "1_2"
    assert note.strip().startswith("* extrapolated: measured up to 1 in ")
    fingers = [line.split() for line in run(*words).stdout.splitlines() if "number" not in line]
    assert [line[-3] for line in fingers if line[-1].endswith(".png")] == ["1_1", "2_1"]


def test_candidates_as_json(run, place, prints, tmp_path):
    shutil.copy(prints / "1_1.png", tmp_path / "probe.png")
    shutil.copy(prints / "empty.png", tmp_path / "empty.png")
    result = run(
        *("identify", place, tmp_path, "--threshold", 60, "--transform", "--json"),
        *("--workers", 1),
    )
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert line == f"fpmatch: error: {tmp_path}/empty.png: the file is empty"
    document = json.loads(result.stdout)
    assert document["compared"] == 3
    assert document["failures"] == [f"{tmp_path}/empty.png: the file is empty"]
    (probe,) = document["probes"]
    assert probe["probe"] == f"{tmp_path}/probe.png"
    best = probe["candidates"][0]
    assert (best["rank"], best["subject"], best["impression"]) == (1, "1", "1")
    assert (document["fingers"], document["listed"]) == (2, "fingers")
    assert best["expected_false_matches"] == 2 * best["fmr"]
    assert best["impressions"] == 2
    assert best["impression_score"] >= best["score"] > 60
    assert best["extrapolated"] is True
    assert best["transform"]["rotation_deg"] == pytest.approx(0, abs=0.1)
    assert best["pairs"] > 10
    assert {c["subject"] for c in probe["candidates"]} == {"1"}


def test_consolidated_templates_change_scores_of_fingers_alone(run, place, prints):
    words = ("identify", place, prints / "1_1.png", "--workers", 1, "--json")
    plain, together = (
        json.loads(run(*words, *more).stdout)["probes"][0]["candidates"]
        for more in ((), ("--consolidate",))
    )
    assert {c["subject"]: c["impressions"] for c in together} == {"1": 2, "2": 1}
    scores = [{c["subject"]: c["score"] for c in found} for found in (plain, together)]
    assert scores[0]["2"] == scores[1]["2"]
    assert scores[0]["1"] != scores[1]["1"]
    refused = run(*words, "--consolidate", "--impressions")
    assert refused.exit_code == 2
    assert "excludes --impressions" in refused.stderr


def test_a_shortlist_is_said(run, place, prints):
    words = ("identify", place, prints / "1_1.png", "-k", 1, "--candidate-list", 2, "--workers", 1)
    result = run(*words)
    assert (result.exit_code, result.stderr) == (0, "")
    head, _, first, _ = result.stdout.splitlines()
    assert head.startswith(f"{prints}/1_1.png: 2 of 3 prints compared in ")
    assert first.split()[-3] == "1_1"
    for option in ("--candidate-list", "--shortlist"):  # the second is the name of 0.1.0
        renamed = [option if word == "--candidate-list" else word for word in words]
        document = json.loads(run(*renamed, "--json").stdout)
        assert (document["enrolled"], document["compared"]) == (3, 2)
    refused = run(*words[:-3], "0")
    assert refused.exit_code == 2
    assert "'0' is not a number from 1 on, auto or off" in refused.stderr


def test_no_candidate_and_an_assumed_resolution_are_said(run, prints, tmp_path):
    open_gallery(tmp_path / "empty.db", create=True).close()
    probe = prints / "untagged.tif"
    result = run("identify", tmp_path / "empty.db", probe, "--matcher", "paper", "--workers", 1)
    assert result.exit_code == 0
    assert result.stdout.startswith(f"{probe}: 0 prints compared in ")
    assert result.stdout.endswith(", no candidate\n")
    assert f"{probe}: {ASSUMED_DPI}" in result.stderr


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["{db}", "{prints}/nowhere.png"], "nowhere.png: no such file or folder"),
        (["{db}", "{prints}/text.png"], "text.png: not an image of a known format"),
        (["{db}", "{prints}/blank.png"], "blank.png: no minutiae found"),
        (["{prints}/no.db", "{prints}/1_1.png"], "no.db: no such gallery"),
        (["{db}", "{prints}/1_1.png", "--matcher", "x"], "matcher 'x'"),
        (["{db}", "{prints}/1_1.png", "--threshold", "101"], "threshold is between 0 and 100"),
        (["{db}", "{prints}/1_1.png", "--calibration", "{prints}/text.png"], "not a calibration"),
    ],
)
def test_bad_input_is_one_line_and_status_2(run, place, prints, words, reason):
    result = run(
        "identify", *(word.format(db=place, prints=prints) for word in words), "--workers", 1
    )
    assert_refused(result, reason)

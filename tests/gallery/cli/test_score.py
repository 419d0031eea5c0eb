"""`fpmatch score`: what it prints, and what becomes of bad input."""

import json
import shutil

import pytest
from PIL import Image, ImageOps

from fpmatch.image.quality.polarity import INVERTED
from fpmatch.prints.reading import ASSUMED_DPI
from tests.conftest import copied, rows_of

SAME = "fpmatch: note: 2 pairs of identical prints: 1_1.png with 1_1.png; 1_2.png with 1_2.png\n"


@pytest.fixture
def pair(prints, tmp_path):
    return copied(prints, tmp_path / "pair", "1_1.png", "1_2.png")


@pytest.fixture
def score(run, pair, tmp_path):
    """Return a function that scores the pair against itself, on one process."""
    usual = ("--references", pair, "--probes", pair, "-o", tmp_path / "scores.csv")
    return lambda *words: run("score", *usual, "--workers", 1, *words)


def test_all_pairs_of_two_folders(score, tmp_path):
    output = tmp_path / "scores.csv"
    result = score()
    assert (result.exit_code, result.stderr) == (0, SAME)
    counts, written = result.stdout.splitlines()
    assert counts.startswith("2 probes against 2 references: 4 pairs: ")
    assert counts.endswith(" a second)")
    assert written == f"{output}: 4 rows"
    scores = {(row["probe"], row["reference"]): row["score"] for row in rows_of(output)}
    assert list(scores) == [(p, r) for p in ("1_1.png", "1_2.png") for r in ("1_1.png", "1_2.png")]
    assert scores["1_1.png", "1_2.png"] == scores["1_2.png", "1_1.png"]


def test_failures_are_rows_lines_and_status_1(score, prints, pair, tmp_path):
    for name in ("text.png", "truncated.png", "untagged.tif"):
        shutil.copy(prints / name, pair)
    listed = tmp_path / "list.csv"
    listed.write_text("probe,reference\n1_1,untagged\ntext,1_1\n1_1,truncated\ntext,text\n")
    result = score("--pairs", listed, "--json")
    assert result.exit_code == 1
    rows = rows_of(tmp_path / "scores.csv")
    assert [bool(row["score"]) for row in rows] == [True, False, False, False]
    assert rows[1]["reason"] == "probe: not an image of a known format"
    assert rows[2]["reason"].startswith("reference: ")
    assert rows[3]["reason"].count("not an image of a known format") == 2
    note, identical, *failed = result.stderr.splitlines()
    assert note.startswith("fpmatch: note: ")
    assert f"untagged.tif: {ASSUMED_DPI}" in note
    assert identical == "fpmatch: note: 1 pair of identical prints: 1_1.png with untagged.tif"
    assert [line.split(": ")[3] for line in failed] == ["text.png", "truncated.png"]
    document = json.loads(result.stdout)
    assert (document["pairs"], document["failed_pairs"], document["rows"]) == (4, 3, 4)
    assert [one["name"] for one in document["failures"]] == ["text.png", "truncated.png"]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_was_noticed_on_reading_is_said_once(score, pair, pressed, workers):
    for name, image in zip(("1_1", "1_2"), pressed[:2], strict=True):
        ImageOps.invert(Image.fromarray(image)).save(pair / f"{name}.png", dpi=(500, 500))
    result = score("--workers", workers, "--json")
    assert result.stderr == f"fpmatch: note: {pair}: 1_1.png and 1 other: {INVERTED}\n{SAME}"
    prints = [f"{pair}: 1_1.png", f"{pair}: 1_2.png"]
    assert json.loads(result.stdout)["notes"] == [{"note": INVERTED, "prints": prints}]


def test_identical_prints_are_found_in_images_and_a_gallery(run, prints, gallery, tmp_path):
    folder = copied(prints, tmp_path / "probes", "2_1.png")
    Image.open(prints / "1_1.png").save(folder / "copy.bmp", dpi=(500, 500))
    words = ("--references", gallery, "--probes", folder, "-o", tmp_path / "out.csv", "--json")
    found = json.loads(run("score", *words, "--workers", 1).stdout)["identical"]
    assert found == {"pairs": 2, "first": [["2_1.png", "2_1"], ["copy.bmp", "1_1"]]}


def test_a_finished_run_is_not_done_again(score, run, gallery, pair, tmp_path):
    output, before = tmp_path / "scores.csv", score().stdout.splitlines()
    content = output.stat()
    again = score()
    assert again.exit_code == 0
    assert again.stderr == f"fpmatch: note: {output}: done already\n"
    assert again.stdout.splitlines()[-1] == before[-1]
    assert output.stat() == content
    output.write_text("another")
    assert "done already" not in score().stderr
    words = ("identify", gallery, "--probes", pair, "-o", tmp_path / "c.csv", "--workers", 1)
    first, second = run(*words), run(*words)
    assert (first.stderr, second.stderr) == ("", f"fpmatch: note: {tmp_path}/c.csv: done already\n")
    assert "done already" not in run(*words, "-k", 1).stderr

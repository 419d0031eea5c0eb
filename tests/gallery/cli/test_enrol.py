import json

import numpy as np
import pytest
from PIL import Image

from fpmatch import assess
from fpmatch.formats.files import save_template
from fpmatch.gallery.gallery import open_gallery
from fpmatch.prints.reading import ASSUMED_DPI
from tests.conftest import copied


@pytest.fixture
def folder(tmp_path, prints):
    """Return a folder with three prints, one of them without a resolution, and two failures."""
    renamed = {"_3_1": "untagged.tif", "_4_1": "truncated.png", "_5_1": "blank.png"}
    folder = copied(prints, tmp_path / "folder", "1_1.png", "2_1.png", **renamed)
    (folder / "README.md").touch()
    return folder


def test_enrol_and_again(run, tmp_path, folder):
    place = tmp_path / "prints.db"
    result = run("enrol", place, folder, "--workers", 1)
    assert result.exit_code == 1
    assert result.stdout.startswith("enrolled 3 of 5 pictures, 2 failed: ")
    note, *failed = result.stderr.splitlines()
    assert note.startswith(f"fpmatch: note: {folder}/3_1.tif: {ASSUMED_DPI}")
    assert [line.split(": ")[:3] for line in failed] == [
        ["fpmatch", "failed", f"{folder}/{name}"] for name in ("4_1.png", "5_1.png")
    ]
    (folder / "4_1.png").unlink()
    (folder / "5_1.png").unlink()
    result = run("enrol", place, folder, "--workers", 1, "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    document = json.loads(result.stdout)
    assert document.pop("seconds") > 0
    assert document == {
        "gallery": str(place),
        "enrolled": 0,
        "known": 3,
        "failed": 0,
        "failures": [],
        "dpi_assumed": 0,
        "notes": [],
        "added": {"impressions": 0, "subjects": 0},
        "unmatched": [],
        "impressions": 3,
        "subjects": 3,
    }


def test_prints_below_the_quality_asked_for_are_refused(run, tmp_path, prints):
    folder = copied(prints, tmp_path / "folder", "1_1.png")
    whole = Image.open(prints / "2_1.png")
    whole.crop((60, 60, 140, 140)).save(folder / "2_1.png", dpi=(500, 500))
    score, small = (assess(folder / f"{name}.png").quality.score for name in ("1_1", "2_1"))
    assert small < score
    words = ("enrol", tmp_path / "prints.db", folder, "--workers", 1)
    result = run(*words, "--min-quality", score)
    assert result.exit_code == 1
    failed = f"fpmatch: failed: {folder}/2_1.png: quality {small}; too small: "
    assert result.stderr.startswith(failed)
    assert run(*words).exit_code == 0


def test_two_prints_in_one_are_named_and_refused_if_strict(run, prints, tmp_path):
    folder = copied(prints, tmp_path / "folder", "1_1.png")
    sides = [np.asarray(Image.open(prints / name)) for name in ("1_1.png", "2_1.png")]
    sides.insert(1, np.full((300, 60), 255, np.uint8))
    Image.fromarray(np.hstack(sides)).save(folder / "3_1.png", dpi=(500, 500))
    words = "enrol", tmp_path / "g.db", folder, "--workers", 1
    result = run(*words, "--strict")
    assert result.exit_code == 1
    failed = f"fpmatch: failed: {folder}/3_1.png: refused: probably two prints in one: the ridges"
    assert failed in result.stderr
    assert f"fpmatch: note: {folder}/3_1.png: probably two prints in one: " in result.stderr
    assert "1 impression of 1 subject" in result.stdout
    result = run(*words)
    assert (result.exit_code, "2 impressions of 2 subjects" in result.stdout) == (0, True)
    assert f"fpmatch: note: {folder}/3_1.png: probably two prints in one: " in result.stderr
    with open_gallery(tmp_path / "g.db") as gallery:
        (_, (_, template)) = gallery.templates()
    save_template(folder / "3_1.json", template)
    for name in ("3_1.png", "3_1.json"):
        assert "; probably two prints in one: " in run("inspect", folder / name).stdout


def test_a_mirrored_sensor_is_enrolled(run, prints, tmp_path):
    folder, place = copied(prints, tmp_path / "mirrored"), tmp_path / "g.db"
    for name in ("1_1.png", "2_1.png"):
        pixels = np.asarray(Image.open(prints / name))[:, ::-1]
        Image.fromarray(pixels).save(folder / name, dpi=(500, 500))
    result = run("enrol", place, folder, "--mirror", "--workers", 1)
    assert (result.exit_code, "left and right are exchanged" in result.stderr) == (0, True)
    (searched,) = json.loads(run("identify", place, prints / "1_1.png", "--json").stdout)["probes"]
    best = searched["candidates"][0]
    assert (best["subject"], best["score"] >= 40) == ("1", True)

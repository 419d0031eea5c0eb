"""The sample prints and points: their truth is right, and they are still made as they are here."""

import hashlib
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.points_csv import load_table
from fpmatch.lab.synthesis.database import Plan
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.pointset.geometry.similarity import Similarity
from research.figures import sample_data
from research.ground_truth import load_truth
from research.markdown import marked_block

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "sample_data"
DATASET = load_dataset(FOLDER)
NAMES = [impression.path.stem for impression in DATASET.impressions]
TRUTH = dict(zip(NAMES, load_truth(DATASET), strict=True))
FINGERS = ("101", "102", "103", "104")
SAID = {finger: json.loads((FOLDER / "truth" / f"{finger}.json").read_text()) for finger in FINGERS}


def said_of(name):
    return SAID[name.partition("_")[0]]["impressions"][name]


def pixels_of(name):
    with Image.open(FOLDER / f"{name}.tif") as image:
        return np.asarray(image)


def test_the_folder_is_an_fvc_style_dataset_of_four_by_four():
    prints = [tuple(map(int, name.split("_"))) for name in NAMES]
    assert prints == [(f, m) for f in range(101, 105) for m in range(1, 5)]
    assert {one.dpi for one in DATASET.impressions} == {500}
    sensors = "synthetic optical-388x374, synthetic optical-328x364"
    assert read_dataset_info(FOLDER).sensor == sensors


@pytest.mark.parametrize("name", NAMES)
def test_a_print_is_what_its_truth_says_of_the_picture(name):
    said, path = said_of(name), FOLDER / f"{name}.tif"
    assert hashlib.sha256(path.read_bytes()).hexdigest() == said["sha256"]
    with Image.open(path) as image:
        assert (image.format, image.mode, list(image.size)) == ("TIFF", "L", said["size"])
        assert tuple(map(float, image.info["dpi"])) == (500.0, 500.0) == (said["dpi"],) * 2
    assert pixels_of(name).shape == SENSORS[said["sensor"]].shape
    assert 0.05 < (pixels_of(name) < 128).mean() < 0.5


def test_the_prints_are_made_as_they_are_here():
    """The skin to the last minutia; the grey levels to what OpenCV's builds may round apart."""
    finger = make_master(sample_data.PRINT_SEED, 101)
    np.testing.assert_allclose(finger.minutiae.x, SAID["101"]["minutiae"]["x"], atol=0.01)
    for number, sensor in enumerate(sample_data.SENSORS, start=1):
        made = make_impression(finger, number, sample_data.PRESET, sensor)
        there = TRUTH[f"101_{number}"]
        assert made.master.tolist() == there.master.tolist()
        assert made.visible.tolist() == there.visible.tolist()
        np.testing.assert_allclose(made.minutiae.xy, there.minutiae.xy, atol=0.01)
        assert isinstance(made.transform, Similarity)
        assert made.transform.rotation == pytest.approx(there.transform.rotation, abs=1e-5)
        difference = np.abs(made.image.astype(int) - pixels_of(f"101_{number}"))
        assert difference.mean() < 0.5
        assert difference.max() <= 10


def test_the_folder_is_made_from_what_the_script_asks_for():
    sensors = tuple(sample_data.SENSORS)
    plan = Plan(sample_data.PRINT_SEED, sample_data.PRESET, sensors, sample_data.IMPRESSIONS)
    assert plan.table() == tomllib.loads((FOLDER / "dataset.toml").read_text())["synthesis"]
    assert len(FINGERS) == sample_data.FINGERS


def test_the_hard_prints_are_made_as_they_are_here():
    folder, plan = FOLDER / "hard", sample_data.HARD
    impressions = load_dataset(folder).impressions
    assert len(impressions) == plan["fingers"] * plan["impressions"]
    described = Plan(plan["seed"], plan["preset"], plan["sensors"], plan["impressions"])
    assert described.table() == tomllib.loads((folder / "dataset.toml").read_text())["synthesis"]
    made = make_impression(make_master(plan["seed"], 103), 2, PRESETS["hard"], plan["sensors"][0])
    difference = np.abs(made.image.astype(int) - pixels_of("hard/103_2"))
    assert difference.mean() < 0.5
    assert difference.max() <= 10
    sizes = [path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()]
    assert sum(sizes) < 2 * 2**20


@pytest.mark.slow
def test_the_tutorial_shows_what_its_changes_do_to_the_hard_prints(run_research):
    printed = run_research("check", "changes").stdout.strip()
    assert printed == marked_block((ROOT / "docs/tutorial/change_a_step.md").read_text(), "changes")
    verdicts = [line.split(" | ")[6].strip() for line in printed.splitlines()[2:]]
    assert verdicts == ["worse", "worse", "within chance", "no change", "worse", "worse"]


def test_the_points_are_made_as_they_are_here_and_their_match_is_the_truth(tmp_path, run_research):
    assert run_research("sample-data", tmp_path, "--only", "points").exit_code == 0
    for name in ("stars.csv", "catalogue.csv", "points_truth.json"):
        assert (tmp_path / name).read_text() == (FOLDER / name).read_text()
    p, q = (load_table(FOLDER / name).points for name in ("stars.csv", "catalogue.csv"))
    truth = json.loads((FOLDER / "points_truth.json").read_text())
    match = match_points(p, q)
    assert match.pairs.tolist() == truth["pairs"]
    apart = match.transform.apply(p) - Similarity(**truth["transform"]).apply(p)
    assert np.hypot(*apart.T).max() < truth["jitter"]

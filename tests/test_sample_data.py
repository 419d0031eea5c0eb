"""The sample prints and points: their truth is right, and they are still made as they are here."""

import hashlib
import itertools
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch.evaluation.dataset import load_dataset
from fpmatch.evaluation.ground_truth.transform_error import common_minutiae
from fpmatch.evaluation.ground_truth.truth import load_truth
from fpmatch.minutiae import MinutiaKind
from fpmatch.pointset.match import match_points
from fpmatch.pointset.points_csv import load_points
from fpmatch.pointset.similarity import Similarity
from fpmatch.synthesis.impression import make_impression
from fpmatch.synthesis.master import make_master
from fpmatch.synthesis.plan import Plan, sensors_named
from fpmatch.synthesis.presets import PRESETS
from fpmatch.synthesis.sensor import SENSORS
from research.figures import sample_data

ROOT = Path(__file__).resolve().parent.parent
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
    prints = [(i.finger, i.number) for i in DATASET.impressions]
    assert prints == [(f, m) for f in range(101, 105) for m in range(1, 5)]
    assert DATASET.dpi == 500
    assert DATASET.sensor == "synthetic optical-388x374, synthetic optical-328x364"


@pytest.mark.parametrize("name", NAMES)
def test_a_print_is_what_its_truth_says_of_the_picture(name):
    said, path = said_of(name), FOLDER / f"{name}.tif"
    assert hashlib.sha256(path.read_bytes()).hexdigest() == said["sha256"]
    with Image.open(path) as image:
        assert (image.format, image.mode, list(image.size)) == ("TIFF", "L", said["size"])
        assert tuple(map(float, image.info["dpi"])) == (500.0, 500.0) == (said["dpi"],) * 2
    assert pixels_of(name).shape == SENSORS[said["sensor"]].shape
    assert 0.05 < (pixels_of(name) < 128).mean() < 0.5


@pytest.mark.parametrize("name", NAMES)
def test_the_warp_carries_the_masters_minutiae_to_those_of_the_picture(name):
    truth, said = TRUTH[name], said_of(name)
    columns = SAID[name.partition("_")[0]]["minutiae"]
    master = np.column_stack([columns["x"], columns["y"]])[truth.master]
    assert np.hypot(*(truth.from_master(master) - truth.minutiae.xy).T).max() < 0.1
    off = truth.transform.apply(master) - truth.minutiae.xy
    assert np.sqrt((off**2).sum(axis=1).mean()) < 3 * said["residual_rms_px"]
    # On screen, the positive rotation of a y-down transform is clockwise.
    turned = np.array(columns["angle_deg"])[truth.master] - truth.transform.rotation_deg
    apart = (np.degrees(truth.minutiae.angle) - turned + 180) % 360 - 180
    assert np.abs(apart).max() < 20
    assert truth.minutiae.kind.tolist() == np.array(columns["kind"])[truth.master].tolist()


@pytest.mark.parametrize("finger", FINGERS)
def test_the_same_minutia_is_found_from_any_impression_in_any_other(finger):
    names = [f"{finger}_{m}" for m in range(1, 5)]
    for one, other in itertools.permutations(names, 2):
        p, q = common_minutiae(TRUTH[one], TRUTH[other])
        assert len(p) >= 7
        assert np.hypot(*(TRUTH[other].from_master(TRUTH[one].to_master(p)) - q).T).max() < 0.1


@pytest.mark.parametrize("name", NAMES)
def test_ink_lies_where_the_truth_says_ridges_and_valleys_are(name):
    """An ending is followed by a ridge in its direction, a bifurcation by a valley."""
    minutiae = TRUTH[name].minutiae.take(TRUTH[name].visible)
    ending = minutiae.kind == MinutiaKind.ENDING
    heading = np.column_stack([np.cos(minutiae.angle), -np.sin(minutiae.angle)])
    contrast = {}
    for sense in (1, -1):
        x, y = np.rint(minutiae.xy + sense * 5.0 * heading).astype(int).T
        grey = pixels_of(name)[y, x].astype(float)
        contrast[sense] = grey[~ending].mean() - grey[ending].mean()
    assert contrast[1] > 0 > contrast[-1]
    assert contrast[1] - contrast[-1] > 60


def test_the_prints_are_made_as_they_are_here():
    """The skin to the last minutia; the grey levels to what OpenCV's builds may round apart."""
    finger = make_master(sample_data.PRINT_SEED, 101)
    np.testing.assert_allclose(finger.minutiae.x, SAID["101"]["minutiae"]["x"], atol=0.01)
    for number, sensor in enumerate(sample_data.SENSORS, start=1):
        made = make_impression(finger, number, PRESETS[sample_data.PRESET], SENSORS[sensor])
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
    sensors = sensors_named(sample_data.SENSORS)
    plan = Plan(sample_data.PRINT_SEED, sample_data.PRESET, sensors, sample_data.IMPRESSIONS)
    assert plan.table() == tomllib.loads((FOLDER / "dataset.toml").read_text())["synthesis"]
    assert len(FINGERS) == sample_data.FINGERS


def test_the_script_replaces_prints_and_leaves_the_rest(tmp_path, monkeypatch):
    made, kept = {"101_1.tif", "dataset.toml", "truth/101.json"}, {"README.md", "stars.csv"}

    def write(folder, names, text):
        (folder / "truth").mkdir(parents=True)
        for name in names:
            (folder / name).write_text(text)

    monkeypatch.setattr(sample_data, "make_database", lambda out, **_: write(out, made, "new"))
    write(tmp_path, {*kept, *made, "105_1.tif", "truth/105.json"}, "old")
    sample_data.make_sample_prints(tmp_path)
    texts = {path.relative_to(tmp_path).as_posix(): path for path in tmp_path.rglob("*.*")}
    assert {name: path.read_text() for name, path in texts.items()} == {
        **dict.fromkeys(kept, "old"),
        **dict.fromkeys(made, "new"),
    }


def test_the_points_are_made_as_they_are_here_and_their_match_is_the_truth(tmp_path, run_research):
    assert run_research("sample-data", tmp_path, "--only", "points").exit_code == 0
    for name in ("stars.csv", "catalogue.csv", "points_truth.json"):
        assert (tmp_path / name).read_text() == (FOLDER / name).read_text()
    p, q = (load_points(FOLDER / name) for name in ("stars.csv", "catalogue.csv"))
    truth = json.loads((FOLDER / "points_truth.json").read_text())
    match = match_points(p, q)
    assert match.pairs.tolist() == truth["pairs"]
    apart = match.transform.apply(p) - Similarity(**truth["transform"]).apply(p)
    assert np.hypot(*apart.T).max() < truth["jitter"]

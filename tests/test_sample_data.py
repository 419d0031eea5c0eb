"""The sample prints: what the folder promises, and that its script still makes it."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fpmatch.evaluation.dataset import load_dataset
from fpmatch.minutiae import Minutiae
from fpmatch.pointset.similarity import Similarity

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "sample_data"
SCRIPT = ROOT / "scripts" / "make_sample_data.py"
TRUTH: dict[str, Any] = json.loads((FOLDER / "truth.json").read_text(encoding="utf-8"))
IMPRESSIONS = sorted(TRUTH["impressions"])
ROUNDING_PX = 0.02


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_sample_data", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def pixels_of(name: str) -> NDArray[np.uint8]:
    with Image.open(FOLDER / f"{name}.tif") as image:
        return np.asarray(image)


def positions(minutiae: dict[str, list[float]]) -> NDArray[np.float64]:
    return np.column_stack([minutiae["x"], minutiae["y"]])


def transform_of(name: str) -> Similarity:
    t = TRUTH["impressions"][name]["transform"]
    return Similarity(t["scale"], t["rotation"], t["tx"], t["ty"])


def masters_of(name: str) -> tuple[dict[str, Any], NDArray[np.int64]]:
    index = np.array(TRUTH["impressions"][name]["minutiae"]["master"])
    return TRUTH["fingers"][name.partition("_")[0]]["minutiae"], index


def turn_between(a_deg: Any, b_deg: Any) -> NDArray[np.float64]:
    return np.abs((np.asarray(a_deg) - np.asarray(b_deg) + 180) % 360 - 180)


def test_the_folder_is_an_fvc_style_dataset_of_four_by_four() -> None:
    dataset = load_dataset(FOLDER)
    assert (dataset.dpi, dataset.sensor) == (500, "synthetic")
    found = [(i.finger, i.number) for i in dataset.impressions]
    assert found == [(f, m) for f in range(101, 105) for m in range(1, 5)]
    assert [f"{f}_{m}" for f, m in found] == IMPRESSIONS


def test_the_folder_stays_small() -> None:
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 3_000_000


@pytest.mark.parametrize("name", IMPRESSIONS)
def test_a_print_is_grey_at_500_dpi_with_dark_ridges_on_bright_paper(name: str) -> None:
    with Image.open(FOLDER / f"{name}.tif") as image:
        assert (image.format, image.mode) == ("TIFF", "L")
        assert list(image.size) == TRUTH["image_size"]
        assert tuple(map(float, image.info["dpi"])) == (500.0, 500.0)
    pixels = pixels_of(name)
    assert np.median(pixels[:5]) > 245
    assert 0.05 < (pixels < 128).mean() < 0.5


@pytest.mark.parametrize("name", IMPRESSIONS)
def test_the_transform_carries_the_masters_minutiae_to_within_the_stretch(name: str) -> None:
    truth = TRUTH["impressions"][name]
    master, index = masters_of(name)
    off = transform_of(name).apply(positions(master)[index]) - positions(truth["minutiae"])
    assert np.sqrt((off**2).sum(axis=1).mean()) < 1.5 * truth["residual_rms_px"] + ROUNDING_PX


@pytest.mark.parametrize("name", IMPRESSIONS)
def test_directions_turn_and_kinds_stay(name: str) -> None:
    minutiae = TRUTH["impressions"][name]["minutiae"]
    master, index = masters_of(name)
    # On screen, the positive rotation of a y-down transform is clockwise.
    expected = np.array(master["angle_deg"])[index] - transform_of(name).rotation_deg
    assert turn_between(minutiae["angle_deg"], expected).max() < 15
    assert minutiae["kind"] == np.array(master["kind"])[index].tolist()


@pytest.mark.parametrize("name", IMPRESSIONS)
def test_minutiae_are_as_many_as_on_a_real_print_and_inside(name: str) -> None:
    columns = dict(TRUTH["impressions"][name]["minutiae"])
    master = columns.pop("master")
    columns["angle"] = np.radians(columns.pop("angle_deg"))
    minutiae = Minutiae(**columns)
    width, height = TRUTH["image_size"]
    assert len(minutiae) == len(set(master))
    assert 12 <= len(minutiae) <= 70
    assert ((minutiae.xy > 0) & (minutiae.xy < (width, height))).all()
    assert set(minutiae.kind.tolist()) == {1, 2}


@pytest.mark.parametrize("finger", sorted(TRUTH["fingers"]))
def test_any_two_impressions_of_a_finger_share_minutiae(finger: str) -> None:
    seen = [set(masters_of(f"{finger}_{m}")[1].tolist()) for m in range(1, 5)]
    assert len(seen[0] & seen[1]) >= 25
    assert all(len(a & b) >= 8 for a in seen for b in seen if a is not b)
    assert abs(transform_of(f"{finger}_1").rotation_deg) <= 7
    assert abs(transform_of(f"{finger}_3").rotation_deg) >= 12


@pytest.mark.parametrize("name", [n for n in IMPRESSIONS if n.endswith(("_1", "_2"))])
def test_ink_lies_where_the_truth_says_ridges_and_valleys_are(name: str) -> None:
    """An ending is followed by a ridge in its direction, a bifurcation by a valley."""
    minutiae = TRUTH["impressions"][name]["minutiae"]
    angle = np.radians(minutiae["angle_deg"])
    ending = np.array(minutiae["kind"]) == 1
    heading = np.column_stack([np.cos(angle), -np.sin(angle)])
    contrast = {}
    for sense in (1, -1):
        x, y = np.rint(positions(minutiae) + sense * 5.0 * heading).astype(int).T
        grey = pixels_of(name)[y, x].astype(float)
        contrast[sense] = grey[~ending].mean() - grey[ending].mean()
    assert contrast[1] > 60
    assert contrast[-1] < -60


def test_the_script_makes_the_prints_that_are_here(script: ModuleType) -> None:
    """The skin to the last minutia; the grey levels to what OpenCV's builds may round apart."""
    finger, impressions = script.make_impressions(0, 4, TRUTH["seed"])
    assert script.columns_of(finger.minutiae) == TRUTH["fingers"]["101"]["minutiae"]
    for m, impression in enumerate(impressions, start=1):
        assert script.truth_of(impression) == TRUTH["impressions"][f"101_{m}"]
        difference = np.abs(impression.image.astype(int) - pixels_of(f"101_{m}"))
        assert difference.mean() < 0.5
        assert difference.max() <= 10


def test_the_same_seed_gives_the_same_files_and_another_seed_others(
    script: ModuleType, tmp_path: Path
) -> None:
    for folder, seed in (("a", 5), ("b", 5), ("c", 6)):
        script.write_dataset(tmp_path / folder, 1, 1, seed)
    a, b, c = ((tmp_path / f / "101_1.tif").read_bytes() for f in "abc")
    assert a == b != c
    assert (tmp_path / "a/truth.json").read_text() == (tmp_path / "b/truth.json").read_text()


def test_unstretched_skin_leaves_nothing_beyond_the_similarity(script: ModuleType) -> None:
    rigid = script.replace(script.CONDITIONS[2], torsion_deg=(0, 0), traction=(0, 0))
    finger = script.make_finger(1, 7)
    impression = script.make_impression(finger, rigid, np.random.default_rng(3))
    moved = impression.transform.apply(finger.minutiae.xy[impression.master])
    assert impression.residual_rms_px < 1e-6
    np.testing.assert_allclose(impression.minutiae.xy, moved, atol=1e-3)


def test_the_way_to_the_sensor_undoes_the_way_to_the_master(script: ModuleType) -> None:
    rng = np.random.default_rng(11)
    for conditions in script.CONDITIONS:
        touch = script.draw_touch(conditions, rng)
        points = rng.uniform(0, 400, (200, 2))
        np.testing.assert_allclose(touch.to_master(touch.from_master(points)), points, atol=1e-6)


def test_an_impossible_count_is_refused_in_words() -> None:
    command = [sys.executable, str(SCRIPT), "--fingers", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "must be at least 1" in done.stderr

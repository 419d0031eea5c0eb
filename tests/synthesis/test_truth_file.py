"""What the file says is what was done."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from fpmatch.pointset.similarity import Similarity
from fpmatch.synthesis.displacement import DisplacementField
from fpmatch.synthesis.impression import Impression, make_impression
from fpmatch.synthesis.master import Master, MasterParameters, make_master
from fpmatch.synthesis.presets import PRESETS
from fpmatch.synthesis.sensor import Sensor
from fpmatch.synthesis.truth_file import finger_truth, impression_truth

SENSOR = Sensor("small", 150, 170, 600.0)


@pytest.fixture(scope="module")
def master() -> Master:
    return make_master(7, 101, MasterParameters(shape=(200, 180)))


@pytest.fixture(scope="module")
def impression(master: Master) -> Impression:
    return make_impression(master, 1, PRESETS["hard"], SENSOR)


@pytest.fixture(scope="module")
def truth(master: Master, impression: Impression) -> dict[str, Any]:
    said = {"101_1": impression_truth(impression, SENSOR, "abc")}
    document: dict[str, Any] = json.loads(finger_truth(master, said))
    return document


def test_the_finger_is_told_whole(master: Master, truth: dict[str, Any]) -> None:
    assert (truth["finger"], truth["seed"], truth["pattern"]) == (101, 7, master.pattern)
    assert truth["master_size"] == [180, 200]
    columns = truth["minutiae"]
    assert columns["kind"] == master.minutiae.kind.tolist()
    np.testing.assert_allclose(columns["x"], master.minutiae.x, atol=0.01)
    np.testing.assert_allclose(columns["y"], master.minutiae.y, atol=0.01)
    np.testing.assert_allclose(np.radians(columns["angle_deg"]), master.minutiae.angle, atol=1e-3)
    for key, points in (("cores", master.cores), ("deltas", master.deltas)):
        np.testing.assert_allclose(np.reshape(truth[key], (-1, 2)), points, atol=0.01)


def test_the_impression_is_told_whole(impression: Impression, truth: dict[str, Any]) -> None:
    said = truth["impressions"]["101_1"]
    assert (said["preset"], said["sensor"], said["dpi"]) == ("hard", "small", 600)
    assert (said["size"], said["sha256"]) == ([150, 170], "abc")
    assert said["residual_rms_px"] == pytest.approx(impression.residual_rms_px, abs=1e-3)
    columns = said["minutiae"]
    np.testing.assert_allclose(columns["x"], impression.minutiae.x, atol=0.01)
    assert columns["master"] == impression.master.tolist()
    assert columns["visible"] == impression.visible.tolist()
    degrees = Similarity(rotation=said["transform"]["rotation"]).rotation_deg
    assert said["transform"]["rotation_deg"] == pytest.approx(degrees, abs=1e-4)


def test_transform_and_displacement_lead_to_the_master(
    impression: Impression, truth: dict[str, Any]
) -> None:
    said = truth["impressions"]["101_1"]
    transform = Similarity(*(said["transform"][key] for key in ("scale", "rotation", "tx", "ty")))
    grid = said["displacement"]
    field = DisplacementField(grid["step"], np.stack([grid["dx"], grid["dy"]], axis=-1))
    y, x = np.mgrid[:170:4, :150:4]
    points = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
    origin = impression.warp.to_master(points)
    found = transform.inverse().apply(field.relaxed(points))
    assert np.hypot(*(found - origin).T).max() < 0.1
    assert np.hypot(*(field.stretched(transform.apply(origin)) - points).T).max() < 0.1


def test_no_angle_is_a_whole_turn_and_no_zero_is_negative(master: Master) -> None:
    content = finger_truth(master, {})
    assert b"-0.0," not in content
    assert all(0 <= angle < 360 for angle in json.loads(content)["minutiae"]["angle_deg"])
    assert content.endswith(b"\n")

import json

import numpy as np
import pytest

from fpmatch.lab.synthesis.impression import finger_truth, impression_truth, make_impression
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import Sensor
from fpmatch.pointset.geometry.similarity import Similarity

SENSOR = Sensor("small", 150, 170, 600.0)


@pytest.fixture(scope="module")
def impression(master):
    return make_impression(master, 1, PRESETS["hard"], SENSOR)


@pytest.fixture(scope="module")
def truth(master, impression):
    said = {"101_1": impression_truth(impression, SENSOR, "abc")}
    return json.loads(finger_truth(master, said))


def test_the_finger_is_told_whole(master, truth):
    assert (truth["finger"], truth["seed"], truth["pattern"]) == (1, 3, master.pattern)
    assert truth["master_size"] == [240, 288]
    columns = truth["minutiae"]
    assert columns["kind"] == master.minutiae.kind.tolist()
    np.testing.assert_allclose(columns["x"], master.minutiae.x, atol=0.01)
    np.testing.assert_allclose(columns["y"], master.minutiae.y, atol=0.01)
    np.testing.assert_allclose(np.radians(columns["angle_deg"]), master.minutiae.angle, atol=1e-3)
    for key, points in (("cores", master.cores), ("deltas", master.deltas)):
        np.testing.assert_allclose(np.reshape(truth[key], (-1, 2)), points, atol=0.01)


def test_the_impression_is_told_whole(impression, truth):
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


def test_no_angle_is_a_whole_turn_and_no_zero_is_negative(master):
    content = finger_truth(master, {})
    assert b"-0.0," not in content
    assert all(0 <= angle < 360 for angle in json.loads(content)["minutiae"]["angle_deg"])
    assert content.endswith(b"\n")

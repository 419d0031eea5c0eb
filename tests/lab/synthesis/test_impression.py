import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from fpmatch.lab.synthesis.impression import finger_truth, impression_truth, make_impression
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import Sensor
from fpmatch.pointset.geometry.similarity import Similarity

SENSOR = Sensor("small", 220, 240)


@pytest.fixture(scope="module")
def normal(master):
    one, two = (make_impression(master, number, PRESETS["normal"], SENSOR) for number in (1, 2))
    return one, two


def test_minutiae_lie_where_the_warp_takes_the_masters_and_turn_with_the_finger(master, normal):
    for made in normal:
        assert len(made.minutiae) == len(made.master) == len(made.visible) > 5
        assert made.visible.any()
        expected = made.warp.from_master(master.minutiae.xy[made.master])
        np.testing.assert_allclose(made.minutiae.xy, expected, atol=1e-3)
        np.testing.assert_array_equal(made.minutiae.kind, master.minutiae.kind[made.master])
        assert np.all((made.minutiae.xy >= 0) & (made.minutiae.xy < SENSOR.shape[::-1]))
        turned = master.minutiae.angle[made.master] - made.transform.rotation
        off = np.mod(made.minutiae.angle - turned + np.pi, 2 * np.pi) - np.pi
        assert np.degrees(np.abs(off)).max() < 15  # what torsion and traction add


def test_the_picture_shows_the_masters_ridges_where_the_warp_puts_them(master):
    made = make_impression(master, 1, PRESETS["clean"], SENSOR)
    y, x = np.mgrid[: SENSOR.height, : SENSOR.width]
    pixels = np.column_stack([x.ravel(), y.ravel()])
    origin = made.warp.to_master(pixels).astype(np.float32).reshape(*SENSOR.shape, 2)
    relief = cv2.remap(master.relief, origin[..., 0], origin[..., 1], cv2.INTER_LINEAR)
    inside = np.hypot(*made.warp.upright(pixels).T).reshape(SENSOR.shape) < 0.6
    likeness = np.corrcoef(relief[inside], made.image[inside])[0, 1]
    assert likeness < -0.85  # ridges are dark
    for shifted in (np.roll(relief, 2, axis=0), np.roll(relief, 2, axis=1)):
        assert np.corrcoef(shifted[inside], made.image[inside])[0, 1] > likeness + 0.02


def test_an_impression_far_off_the_sensor_is_empty_and_still_true(master):
    placement = replace(PRESETS["clean"].placement, shift=(900, 900))
    made = make_impression(master, 1, replace(PRESETS["clean"], placement=placement), SENSOR)
    assert made.image.min() > 150
    assert len(made.minutiae) == 0
    assert isinstance(made.transform, Similarity)


def test_nothing_is_seen_under_the_frame(master):
    sensor = Sensor("framed", 220, 240, frame=0.45)
    made = make_impression(master, 1, PRESETS["clean"], sensor)
    x, y = made.minutiae.xy.T
    cut = sensor.frame * sensor.width * (1 - y / (sensor.height - 1))
    under = (x < cut) | (sensor.width - 1 - x < cut)
    assert under.any()
    assert not made.visible[under].any()
    assert made.visible.any()


FINE = Sensor("small", 150, 170, 600.0)


@pytest.fixture(scope="module")
def impression(master):
    return make_impression(master, 1, PRESETS["hard"], FINE)


@pytest.fixture(scope="module")
def truth(master, impression):
    said = {"101_1": impression_truth(impression, FINE, "abc")}
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

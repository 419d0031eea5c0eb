import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import ImageError
from fpmatch.lab.synthesis.displacement import DisplacementField
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor
from fpmatch.lab.synthesis.truth_file import NODE_EVERY_PX, finger_truth, impression_truth
from fpmatch.lab.synthesis.warp import draw_warp
from fpmatch.pointset.geometry.similarity import Similarity

SENSOR = Sensor("small", 150, 170, 600.0)


def grid(shape, step=1):
    y, x = np.mgrid[: shape[0] : step, : shape[1] : step]
    return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)


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


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 15))
def test_nodes_lie_around_every_pixel(rows, columns, step):
    field = DisplacementField.sampled(lambda p: p, (rows, columns), step)
    for side, nodes in zip((rows, columns), field.shift.shape, strict=False):
        last_inner = (nodes - 3) * step
        assert side - 1 <= last_inner < side - 1 + 2 * step


def test_quadratic_shifts_are_exact_between_the_nodes():
    def bent(p):
        x, y = p.T
        return p + np.column_stack([0.01 * x * x - 0.3 * y, 0.02 * x * y + 1.0])

    points = grid((30, 40), 3) + 0.37
    field = DisplacementField.sampled(bent, (31, 41), 8)
    np.testing.assert_allclose(field.relaxed(points), bent(points), atol=1e-9)


def test_beyond_the_picture_the_edge_goes_on():
    field = DisplacementField.sampled(lambda p: 1.1 * p, (33, 41), 8)
    np.testing.assert_allclose(field.at([[-50, 3]]), field.at([[0, 3]]))
    np.testing.assert_allclose(field.at([[999, 999]]), [[4.8, 4.0]])
    assert field.at(np.empty((0, 2))).shape == (0, 2)
    assert not field.shift.flags.writeable


@pytest.mark.parametrize("preset", ["normal", "hard"])
@pytest.mark.parametrize("sensor", ["optical-388x374", "optical-296x560"])
def test_rounded_shifts_place_the_skin_within_a_tenth_of_a_pixel(preset, sensor):
    taken = SENSORS[sensor]
    points = grid(taken.shape, 5)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        warp = draw_warp((560, 440), taken.shape, taken.dpi, rng, PRESETS[preset].placement)
        touching = points[warp.radius(points) < 1]
        origin = warp.to_master(touching)
        transform = Similarity.fit(origin, touching)
        relaxed = lambda p, t=transform, w=warp: t.apply(w.to_master(p))  # noqa: E731
        field = DisplacementField.sampled(relaxed, taken.shape, round(NODE_EVERY_PX * taken.px))
        field = DisplacementField(field.step, field.shift.round(2))
        unstretched = transform.apply(origin)
        assert np.hypot(*(field.relaxed(touching) - unstretched).T).max() < 0.1
        assert np.hypot(*(field.stretched(unstretched) - touching).T).max() < 0.1


@pytest.mark.parametrize(
    ("step", "shape"), [(8, (4, 4)), (8, (3, 4, 2)), (8, (4, 3, 2)), (8, (4, 4, 3)), (0, (4, 4, 2))]
)
def test_grids_that_are_none_are_refused(step, shape):
    with pytest.raises(ImageError, match="a displacement field needs"):
        DisplacementField(step, np.zeros(shape))
    with pytest.raises(ImageError, match="finite"):
        DisplacementField(8, np.full((4, 4, 2), np.nan))

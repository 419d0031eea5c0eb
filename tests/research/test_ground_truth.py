"""The truth read back, and extracted minutiae and transforms measured against it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.lab.synthesis.impression import finger_truth, impression_truth, make_impression
from fpmatch.lab.synthesis.master import MasterParameters, make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template
from research.ground_truth import (
    ImpressionTruth,
    assign_minutiae,
    count_minutiae,
    load_truth,
    measure_transform,
)

TURN = np.pi / 8


def minutiae(*rows):
    """Return minutiae of x, y and degrees."""
    x, y, degrees = np.array(rows, np.float64).reshape(-1, 3).T
    return Minutiae(x, y, np.radians(degrees), np.ones(len(x), np.uint8))


def truth_of(true, visible=None, hidden=()):
    seen = np.ones(len(true), bool) if visible is None else np.array(visible, bool)
    hidden = np.vstack([true.xy[~seen], np.reshape(hidden, (-1, 2))])
    return ImpressionTruth(Similarity(), true, np.arange(len(true)), seen, hidden)


@pytest.mark.parametrize("preset", ["normal", "hard"])
def test_a_file_places_every_point_of_the_skin_within_a_tenth_of_a_pixel(tmp_path, preset):
    sensor = SENSORS["optical-296x560"]
    master = make_master(5, 101, MasterParameters())
    made = make_impression(master, 1, PRESETS[preset], sensor)
    (tmp_path / "truth").mkdir()
    content = finger_truth(master, {"101_1": impression_truth(made, sensor, "")})
    (tmp_path / "truth" / "101.json").write_bytes(content)
    dataset = SimpleNamespace(impressions=[SimpleNamespace(path=tmp_path / "101_1.tif")])
    (read,) = load_truth(dataset)
    assert (read.visible == made.visible).all()
    assert len(read.hidden_xy) == len(master.minutiae) - made.visible.sum()
    y, x = np.mgrid[: sensor.height : 9, : sensor.width : 9]
    points = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
    touching = points[np.hypot(*made.warp.upright(points).T) < 1]
    origin = made.warp.to_master(touching)
    assert np.hypot(*(read.to_master(touching) - origin).T).max() < 0.1
    assert np.hypot(*(read.from_master(origin) - touching).T).max() < 0.1
    (tmp_path / "truth" / "101.json").write_text("{}")
    with pytest.raises(DatasetError, match="no truth of 'impressions'"):
        load_truth(dataset)


@given(st.integers(0, 9), st.integers(0, 9), st.integers(0, 2**32))
def test_the_assignment_is_the_largest_and_one_to_one(extracted, true, seed):
    rng = np.random.default_rng(seed)
    one, other = (
        minutiae(*np.column_stack([rng.uniform(0, 40, (n, 2)), rng.uniform(0, 90, n)]))
        for n in (extracted, true)
    )
    visible = rng.random(true) < 0.6
    pairs = assign_minutiae(one, other, visible, 12, TURN)
    for column in pairs.T:
        assert len(set(column)) == len(column)
    apart = one.xy[pairs[:, 0]] - other.xy[pairs[:, 1]]
    assert (np.hypot(*apart.T) <= 12).all()
    alone = assign_minutiae(one, other.take(visible), np.ones(visible.sum(), bool), 12, TURN)
    assert visible[pairs[:, 1]].sum() == len(alone)


def test_false_minutiae_are_counted_by_their_causes():
    true = minutiae((100, 100, 0), (150, 100, 0), (150, 150, 0), (60, 150, 90))
    truth = truth_of(true, [True, True, True, False], hidden=[(200, 200)])
    found = minutiae(
        (103, 100, 5), (150, 101, 180), (61, 150, 90), (5, 100, 0), (205, 190, 0), (104, 108, 90),
        (120, 130, 0),
    )  # fmt: skip
    counts = count_minutiae(Template(found, 250, 250), truth)
    false = {"direction": 1, "border": 1, "no ridges": 1, "near another": 1, "other": 1}
    assert counts == {"visible": 3, "right": 1, **false}
    assert count_minutiae(None, truth) == {"visible": 3}


def test_a_transform_is_measured_at_the_common_minutiae():
    rows = [(x, y, 0) for x in (50, 100, 150) for y in (60, 120)]
    probe = truth_of(minutiae(*rows))
    moved = Similarity(1.0, 0.1, 5.0, -3.0)
    shown = moved.apply(probe.minutiae.xy)
    reference = replace(truth_of(minutiae(*np.column_stack([shown, np.zeros(6)]))), transform=moved)
    assert max(measure_transform(moved, probe, reference, 500)) < 1e-4
    off = measure_transform(Similarity(1.0, 0.1, 15.0, -3.0), probe, reference, 1000)
    assert off == pytest.approx((0, 5, 5), abs=1e-4)
    assert min(measure_transform(None, probe, reference, 500)) == np.inf


def test_the_command_measures_sample_prints(run_research):
    printed = run_research("check", "truth", "../sample_data", "--workers", "1").stdout
    row = [cell.strip() for cell in printed.splitlines()[2].strip("|").split("|")]
    visible, right, *false, judged, in_place = map(int, row[1:-1])
    assert right > 0.8 * visible
    assert sum(false) < 0.3 * visible
    assert 20 <= in_place <= judged <= 24

import math
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.errors import DatasetError
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import MasterParameters, make_master
from fpmatch.lab.synthesis.plan import plain_sensor
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import Sensor
from fpmatch.matching.pipeline._kernels._alignment_kernel import COMPILED
from fpmatch.pointset.geometry.similarity import Similarity
from research.experiments.distortion import (
    CONDITIONS,
    KINDS,
    DistortionParameters,
    distorted,
    distortion_between,
    measure_distortion,
    true_transform,
)
from research.tables.accuracy import distortion_rows, strain_class

SENSOR = Sensor("small", 220, 240)
SMALL = DistortionParameters(fingers=2, impressions=2, limits=(0.1, 0.3), min_pairs=1)


@pytest.fixture(scope="module")
def impression():
    finger = make_master(7, 1, MasterParameters(shape=(200, 160)))
    return make_impression(finger, 1, PRESETS["clean"], plain_sensor(160, 200))


def warped(impression, **changes):
    return replace(impression, warp=replace(impression.warp, **changes))


def test_a_similarity_has_no_strain(impression):
    still = warped(impression, torsion=0.0, traction=(0.0, 0.0))
    old = still.warp.placement
    placed = Similarity(1.1 * old.scale, old.rotation + 0.3, old.tx + 2.0, old.ty - 5.0)
    strain, displacement = distortion_between(still, warped(still, placement=placed))
    assert strain == pytest.approx(0.0, abs=1e-6)
    assert displacement == pytest.approx(0.0, abs=1e-4)


def test_strain_and_displacement_grow_with_the_drag(impression):
    still = warped(impression, torsion=0.0, traction=(0.0, 0.0))
    pulled = [warped(still, traction=(pull, 0.0)) for pull in (0.0, 5.0, 10.0, 20.0)]
    strain, displacement = np.array([distortion_between(still, one, grid_px=8) for one in pulled]).T
    assert strain[0] == pytest.approx(0.0, abs=1e-6)
    assert (np.diff(strain) > 0).all()
    assert (np.diff(displacement) > 0).all()
    # a slide reaches its full length over one radius, by half a cosine: pi / 2 of the mean slope
    steepest = 0.5 * math.pi * 20.0 / still.warp.half_axes[0]
    assert 0.5 * steepest < strain[3] < steepest / (1 - steepest)
    far = replace(impression.warp.placement, tx=10_000.0)
    with pytest.raises(DatasetError, match="too little skin"):
        distortion_between(impression, warped(impression, placement=far))


def test_the_true_transform_takes_minutiae_near_their_places_and_back():
    finger = make_master(3, 1, MasterParameters(shape=(288, 240)))
    one, two = (make_impression(finger, k, PRESETS["normal"], SENSOR) for k in (1, 2))
    _, in_one, in_two = np.intersect1d(one.master, two.master, return_indices=True)
    visible = one.visible[in_one] & two.visible[in_two]
    transform = true_transform(one, two)
    a, b = one.minutiae.xy[in_one][visible], two.minutiae.xy[in_two][visible]
    assert len(a) > 3
    assert np.hypot(*(transform.apply(a) - b).T).max() < 12
    round_trip = transform.after(true_transform(two, one))
    assert round_trip.rotation_deg == pytest.approx(0, abs=1)


def test_the_last_impression_is_the_most_distorted_and_the_skin_does_not_fold():
    p = DistortionParameters()
    preset = distorted(PRESETS["clean"], 1.0, p)
    assert preset.placement.torsion_deg == (p.max_torsion_deg,) * 2
    assert preset.placement.traction == (p.max_traction_px,) * 2
    assert replace(preset, placement=PRESETS["clean"].placement) == PRESETS["clean"]


@pytest.mark.slow
def test_the_measurement_repeats_itself_and_makes_a_table():
    result = measure_distortion(SMALL, workers=1)
    assert [condition["name"] for condition in result["conditions"]] == list(CONDITIONS)
    for condition in result["conditions"]:
        assert (condition["genuine"], condition["impostor"]) == (2, 4)
        assert sum(row["pairs"] for row in condition["classes"]) == 2
        for row in condition["classes"]:
            assert row["from"] <= row["strain"] < (row["to"] or math.inf)
            for kind in KINDS:
                assert row[kind]["lower_quartile"] <= row[kind]["score"]
                assert row[kind]["score"] <= row[kind]["upper_quartile"] <= 100
                assert row[kind]["fnmr"] is None  # 4 impostor pairs cannot show 0.1 %
    assert not COMPILED or measure_distortion(SMALL, workers=1) == result
    whole = result["conditions"][0]
    head, *rows = distortion_rows([whole, whole], "ridges", ("before:", "now:"))
    assert head[3:5] == ["before: median score", "now: median score"]
    assert [row[0] for row in rows] == [strain_class(row) for row in whole["classes"]]
    assert all(row[3] == row[4] and row[-1] == "-" for row in rows)
    other = {**whole, "classes": [{**row, "pairs": 99} for row in whole["classes"]]}
    with pytest.raises(DatasetError, match="not of the same pairs"):
        distortion_rows([whole, other], "ridges")

from __future__ import annotations

import json

import numpy as np
import pytest

from fpmatch.evaluation import calibration_reach
from fpmatch.evaluation.bootstrap import Trials
from fpmatch.evaluation.calibrate import calibrate_on
from fpmatch.evaluation.calibration_reach import format_reach, measure_reach
from fpmatch.evaluation.impostors import ImpostorSet
from fpmatch.matching.calibration import Calibration, score_to_fmr


def impostors(name="ours", fingers=12, impressions=5, seed=0):
    rng = np.random.default_rng(seed)
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    apart = finger[i] != finger[j]
    similarity = rng.exponential(1.0, i.size)[apart]
    return ImpostorSet(name, Trials(similarity, finger[i][apart], finger[j][apart], fingers))


@pytest.fixture
def sets():
    return [impostors(), impostors("theirs", seed=1)]


def test_reach_is_where_the_knots_end(sets):
    calibration = calibrate_on(sets, "fake")
    found = measure_reach(calibration, sets, resamples=50)
    assert (found.sets, found.fingers, found.impostors) == (2, 24, 2 * 1650)
    assert found.reach == calibration.largest_measured_score
    assert found.fmr_at_reach.low <= score_to_fmr(found.reach) <= found.fmr_at_reach.high
    assert found.highest > found.reach
    assert found.package == ()


def test_share_that_reached_a_score_by_the_packages_own_calibration(sets, monkeypatch):
    ten_a_unit = Calibration(((0.0, 0.0), (9.0, 90.0)), tail_scale=1.0)
    monkeypatch.setattr(calibration_reach, "calibrated_matchers", lambda: ["fake"])
    monkeypatch.setattr(calibration_reach, "load_calibration", lambda name: ten_a_unit)
    found = measure_reach(calibrate_on(sets, "fake"), sets, resamples=20)
    pooled = np.concatenate([one.trials.similarity for one in sets])
    assert found.package == ((20.0, np.mean(pooled >= 2.0)), (30.0, np.mean(pooled >= 3.0)))
    assert "As supplied 1 in 7.6 reach 20 on the package" in format_reach(found)


def test_words_say_where_extrapolation_begins(sets):
    found = measure_reach(calibrate_on(sets, "fake"), sets, resamples=20)
    text = format_reach(found)
    assert "3,300 comparisons of different fingers, 24 in all (2 databases)" in text
    assert "Reach       score 22.2, a false match rate of 1 in 160" in text
    assert "Beyond      scores are extrapolated" in text
    assert "so is the default threshold, 40: to reach it takes some\n" in text
    assert "200,000 comparisons" in text


def test_json(sets):
    found = measure_reach(calibrate_on(sets, "fake"), sets, resamples=20)
    document = json.loads(json.dumps(found.as_json()))
    assert document["reach_fmr"] == pytest.approx(20 / 3300)
    assert len(document["reach_fmr_interval"]) == 2

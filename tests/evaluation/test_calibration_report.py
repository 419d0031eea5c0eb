import json

import numpy as np
import pytest

from fpmatch.evaluation import calibration_report
from fpmatch.evaluation.calibrate import calibrate_on
from fpmatch.evaluation.calibration_report import report_calibration
from fpmatch.evaluation.impostors import ImpostorSet
from fpmatch.evaluation.rates.scores_set import Trials
from fpmatch.matching.calibration import Calibration


def impostors(name, seed, fingers=12, impressions=5):
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    apart = finger[i] != finger[j]
    similarity = np.random.default_rng(seed).exponential(1.0, i.size)[apart]
    return ImpostorSet(name, Trials(similarity, finger[i][apart], finger[j][apart], fingers))


SETS = [impostors("ours", 0), impostors("theirs", 1)]
CALIBRATION = calibrate_on(SETS, "fake")


def test_the_largest_measured_score_is_where_the_knots_end():
    found = report_calibration(CALIBRATION, SETS, bootstrap=50)
    assert (found.sets, found.fingers, found.impostors) == (2, 24, 2 * 1650)
    assert found.largest_measured_score == CALIBRATION.largest_measured_score
    assert found.fmr_interval.low <= found.smallest_measured_fmr <= found.fmr_interval.high
    assert found.highest_score > found.largest_measured_score
    assert found.package == ()
    document = json.loads(json.dumps(found.as_json()))
    assert document["smallest_measured_fmr"] == pytest.approx(20 / 3300)
    assert document["smallest_measured_fmr_interval"] == list(found.fmr_interval)
    text = found.as_text()
    assert "3,300 impostor comparisons\n              of 24 fingers (2 databases)" in text
    assert "Measured    up to score 22.2, a false match rate of 1 in 160" in text
    assert "so is the default threshold, 40: to measure it takes\n" in text
    assert "200,000 impostor comparisons" in text


def test_share_that_reached_a_score_by_the_packages_own_calibration(monkeypatch):
    ten_a_unit = Calibration(((0.0, 0.0), (9.0, 90.0)), tail_scale=1.0)
    monkeypatch.setattr(calibration_report, "calibration_of", lambda name: ten_a_unit)
    found = report_calibration(CALIBRATION, SETS, bootstrap=20)
    pooled = np.concatenate([one.trials.similarity for one in SETS])
    assert found.package == ((20.0, np.mean(pooled >= 2.0)), (30.0, np.mean(pooled >= 3.0)))
    assert "As supplied 1 in 7.6 reach 20 on the package" in found.as_text()


def test_scores_of_unknown_fingers_have_no_interval():
    rng = np.random.default_rng(3)
    unknown = Trials(rng.exponential(size=2000), np.zeros(2000, int), np.ones(2000, int), 0)
    sets = [ImpostorSet("scores", unknown)]
    found = report_calibration(calibrate_on(sets, "fake"), sets)
    assert (found.fmr_interval, found.fingers) == (None, 0)
    assert "of unknown fingers" in found.as_text()

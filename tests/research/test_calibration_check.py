import json
from types import SimpleNamespace

import numpy as np
import pytest

from fpmatch.errors import MatcherError
from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.lab.evaluation.databases.comparison import OUTCOME
from fpmatch.lab.evaluation.impostors import ImpostorSet
from fpmatch.lab.evaluation.rates.scores_set import Trials
from fpmatch.lab.evaluation.run import evaluate
from fpmatch.matching.calibration import Calibration
from research.experiments.calibration_check import (
    CalibrationCheck,
    check_calibration,
    check_impostors,
    format_calibration,
)

TEN_A_UNIT = Calibration(((0.0, 0.0), (10.0, 100.0)), tail_scale=1.0)
NAME = "unit-circle"


def set_of(name, impostors, genuine=(), no_template=0):
    """Return a database's row of a report with these similarities."""
    similarity = [*impostors, *genuine, *[9.0] * no_template]
    outcomes = np.zeros(len(similarity), OUTCOME)
    outcomes["similarity"] = similarity
    outcomes["reason"] = ""
    outcomes["reason"][len(similarity) - no_template :] = NO_TEMPLATE
    is_genuine = np.zeros(len(similarity), bool)
    is_genuine[len(impostors) : len(impostors) + len(genuine)] = True
    return SimpleNamespace(name=name, outcomes=outcomes, pairs=SimpleNamespace(genuine=is_genuine))


def check_of(*rows):
    return check_calibration(SimpleNamespace(matcher=NAME, sets=rows), TEN_A_UNIT)


def test_impostors_are_counted_at_each_score_and_no_other_pairs_are():
    (check,) = check_of(set_of("one", [0.5, 1.9, 2.0, 2.5, 4.0], genuine=[8.0], no_template=3))
    assert check == CalibrationCheck("one", 5, (3, 1, 1))
    assert check.shares == (0.6, 0.2, 0.2)
    assert check.factors == pytest.approx((60.0, 200.0, 2000.0))
    *each, together = check_of(set_of("one", [2.0, 0.0]), set_of("two", [3.0] * 3))
    assert [check.name for check in each] == ["one", "two"]
    assert together == CalibrationCheck("all", 5, (4, 3, 0))


@pytest.mark.parametrize(
    ("reached", "kept"), [((100, 10, 1), True), ((50, 20, 2), True), ((49, 21, 0), False)]
)
def test_a_factor_of_two_either_way_is_kept(reached, kept):
    assert CalibrationCheck("one", 10_000, reached).kept == (kept,) * 3


def test_the_table_and_json_hold_the_counts():
    check = CalibrationCheck("one", 10_000, (100, 30, 1))
    entry = json.loads(json.dumps(check.as_json()))
    assert "| one | 10,000 | 1.0000 % | 1.00 | 0.3000 % | 3.00 |" in format_calibration([entry])
    assert entry["scores"][1] == {"score": 30.0, "reached": 30, "share": 0.003, "factor": 3.0}


def test_an_evaluation_is_checked_by_the_calibration_given_or_refused(bench, make_database):
    report = evaluate(
        [make_database()], matcher=bench.MATCHER, extractor=bench.extractor, workers=1
    )
    (check,) = check_calibration(report, TEN_A_UNIT)
    assert check.impostors == report.sets[0].impostor
    assert check.reached == (0, 0, 0)
    with pytest.raises(MatcherError):
        check_calibration(report)


def test_impostors_are_checked_by_the_calibration_given_or_the_matchers_own():
    trials = Trials(np.array([0.5, 2.0, 4.0]), np.zeros(3, int), np.ones(3, int), 2)
    among = ImpostorSet("among", trials)
    assert check_impostors(among, NAME, TEN_A_UNIT) == CalibrationCheck("among", 3, (2, 1, 1))
    assert check_impostors(among, NAME).impostors == 3
    with pytest.raises(MatcherError):
        check_impostors(among, "no such matcher")

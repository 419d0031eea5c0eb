"""`fpmatch.evaluation.calibration_check`: impostors counted, and held against the scores."""

from __future__ import annotations

import itertools
import json
from types import SimpleNamespace

import numpy as np
import pytest

from fpmatch.errors import MatcherError
from fpmatch.evaluation import calibration_check
from fpmatch.evaluation.calibration_check import (
    CalibrationCheck,
    check_among,
    check_calibration,
    format_calibration_checks,
)
from fpmatch.evaluation.comparison import NO_TEMPLATE, OUTCOME
from fpmatch.evaluation.dataset import Dataset, Impression
from fpmatch.evaluation.extraction import ExtractedSet, Extraction
from fpmatch.evaluation.run import evaluate
from fpmatch.matching.calibration import Calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.minutiae import Minutiae, Template

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


def test_impostors_are_counted_at_each_score_and_no_other_pairs_are():
    row = set_of("one", [0.5, 1.9, 2.0, 2.5, 4.0], genuine=[8.0], no_template=3)
    (check,) = check_calibration(SimpleNamespace(matcher=NAME, sets=(row,)), TEN_A_UNIT)
    assert check == CalibrationCheck("one", 5, (3, 1, 1))
    assert check.shares == (0.6, 0.2, 0.2)
    assert check.factors == pytest.approx((60.0, 200.0, 2000.0))


def test_several_databases_are_followed_by_all_of_them():
    rows = (set_of("one", [2.0, 0.0]), set_of("two", [3.0] * 3))
    *each, together = check_calibration(SimpleNamespace(matcher=NAME, sets=rows), TEN_A_UNIT)
    assert [check.name for check in each] == ["one", "two"]
    assert together == CalibrationCheck("all", 5, (4, 3, 0))


@pytest.mark.parametrize(
    ("reached", "kept"),
    [
        ((100, 10, 1), (True, True, True)),
        ((50, 20, 2), (True, True, True)),
        ((49, 21, 0), (False, False, False)),
    ],
)
def test_a_factor_of_two_either_way_is_kept(reached, kept):
    assert CalibrationCheck("one", 10_000, reached).kept == kept


def test_the_table_marks_what_is_not_kept_and_json_holds_the_counts():
    check = CalibrationCheck("one", 10_000, (100, 30, 1))
    table = format_calibration_checks([check])
    assert table.splitlines()[1].split()[1:4] == ["10000", "1.0000", "%"]
    assert table.count("!") == 1
    entry = json.loads(json.dumps(check.as_json()))
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


def a_set(name, seed, folder):
    """Return impressions of two fingers, the last without a template."""
    rng = np.random.default_rng(seed)
    taken, extractions = [], []
    for finger in (1, 2):
        x, y, angle = rng.uniform(20, 180, (3, 12))
        for number in (1, 2, 3):
            taken.append(Impression(finger, number, folder / f"{finger}_{number}.tif"))
            template = Template(Minutiae(x + number, y, angle), 200, 200)
            extractions.append(Extraction(template, "", 0.0))
    extractions[-1] = Extraction(None, "no ridges", 0.0)
    return ExtractedSet(Dataset(name, 500.0, "", tuple(taken)), tuple(extractions))


@pytest.mark.parametrize("workers", [1, 2])
def test_among_all_impressions_those_of_other_fingers_are_counted(tmp_path, workers, monkeypatch):
    sets = [a_set("one", 1, tmp_path), a_set("two", 2, tmp_path)]
    shown = [
        (number, impression.finger, found.template)
        for number, one in enumerate(sets)
        for impression, found in zip(one.dataset.impressions, one.extractions, strict=True)
        if found.template is not None
    ]
    similarities = [
        MATCHER.compare(MATCHER.prepare(a), MATCHER.prepare(b)).similarity
        for (*finger, a), (*other, b) in itertools.combinations(shown, 2)
        if finger != other
    ]
    middle = float(np.median(similarities))
    steep = Calibration(((0.0, 0.0), (middle, 20.0)), tail_scale=1.0)
    monkeypatch.setattr(calibration_check, "load_calibration", lambda _: steep)
    found = check_among(sets, "both", workers)
    assert (found.name, found.impostors) == ("both", 37)
    scores = steep.scores(similarities)
    assert found.reached == tuple(int((scores >= at).sum()) for at in (20, 30, 40))
    assert 0 < found.reached[0] < 37

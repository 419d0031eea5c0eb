import json

import numpy as np
import pytest

from fpmatch.lab.evaluation.rates.bootstrap import bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.intervals import Interval, exact_interval, interval_of, wider
from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials
from fpmatch.lab.evaluation.report.analysis import analyse
from fpmatch.lab.evaluation.report.results import RatesReport, SetRates
from fpmatch.lab.evaluation.run import evaluate


def separated(fingers, impressions=2, name="db", sign=1):
    """Return all pairs of some prints, the genuine ones alike; with a sign of -1 the others."""
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    similarity = sign * (finger[i] == finger[j]) + np.linspace(0.0, 0.5, i.size)
    prints = tuple(f"{f}_{k}" for k, f in enumerate(finger))
    trials = Trials(similarity, finger[i], finger[j], fingers)
    return ScoresSet("fake", name, prints, i, j, trials, np.ones(i.size, bool))


def intervals_of(*sets):
    report = RatesReport.of([SetRates.of(one) for one in sets])
    return analyse(report, bootstrap=20).intervals


def test_the_rate_lies_within_its_interval(report):
    *sets, mean, pooled = analyse(report, bootstrap=300).intervals
    for row, intervals in zip(report.sets, sets, strict=True):
        assert intervals["eer"].low < row.rates.eer < intervals["eer"].high
        assert intervals["rank_one"].low <= row.rank_one <= intervals["rank_one"].high
        assert intervals["fmr1000"] is None
    assert mean["eer"].low <= report.mean.eer <= mean["eer"].high
    assert pooled["eer"].low <= report.pooled.eer <= pooled["eer"].high
    assert pooled["rank_one"].low <= report.rank_one <= pooled["rank_one"].high


def test_the_seed_makes_the_draws_and_json_has_pairs_of_limits(report):
    first, again, other = (analyse(report, bootstrap=50, seed=s) for s in (1, 1, 2))
    assert first.intervals == again.intervals
    assert first.intervals[-1] != other.intervals[-1]
    document = json.loads(json.dumps(first.as_json()))["intervals"]
    assert (document["confidence"], document["method"]) == (0.95, "bootstrap")
    eer = first.intervals[-1]["eer"]
    assert document["pooled"]["eer"] == [eer.low, eer.high]
    assert document["sets"][1]["fmr10000"] is None


def test_few_fingers_have_no_interval_and_the_fvc_protocol_no_rank(options, make_database):
    folders = [make_database("few", fingers=4), make_database("enough", fingers=5)]
    found = analyse(evaluate(folders, **options), bootstrap=50).intervals
    assert [one["eer"] is None for one in found] == [1, 0, 1, 1]
    fvc = evaluate(folders[1:], protocol="fvc", **options)
    first, *_ = analyse(fvc, bootstrap=50).intervals
    assert first["rank_one"] is None
    assert first["eer"] is not None


def test_draws_without_a_rate_are_left_out_until_too_many():
    draws = np.array([0.1, 0.2, 0.3, np.nan])
    assert interval_of(draws) == Interval(pytest.approx(0.105), pytest.approx(0.295))
    assert interval_of(np.array([0.1, np.nan])) is None


def test_the_wider_of_two_intervals_counts():
    drawn, exact = Interval(0.0, 0.5), exact_interval(0.0, 10, "finger")
    assert wider(drawn, exact) == drawn
    assert wider(Interval(0.0, 0.0), exact) == wider(None, exact) == exact
    assert wider(None, None) is None
    assert exact_interval(0.0, 0, "finger") is None


def test_intervals_cover_the_true_rate_about_as_often_as_they_say():
    # Fingers that differ, as fingers do; the truth is what many of them show.
    rng = np.random.default_rng(5)

    def world(fingers, impressions):
        finger = np.repeat(np.arange(fingers), impressions)
        ease = rng.standard_normal(fingers)
        a, b = (finger[side] for side in np.triu_indices(finger.size, k=1))
        similarity = rng.standard_normal(a.size) + (a == b) * (2 + ease[a])
        return Trials(similarity, a, b, fingers)

    large = world(400, 3)
    truth = error_rates(large.similarity[large.genuine], large.similarity[~large.genuine]).eer
    draws = [bootstrap_rates([world(25, 4)], 100, seed=k).pooled[:, 0] for k in range(40)]
    intervals = [interval_of(one) for one in draws]
    assert sum(one.low <= truth <= one.high for one in intervals) >= 33


@pytest.mark.parametrize(
    ("fingers", "finger_limit", "pair_limit"), [(3, 0.6316, None), (10, 0.2589, 0.4507)]
)
def test_a_rate_of_0_or_1_has_a_limit_by_fingers_and_no_eer_one_above_half(
    fingers, finger_limit, pair_limit
):
    found, *_ = intervals_of(separated(fingers))
    assert found["rank_one"] == Interval(
        pytest.approx(1 - finger_limit, abs=1e-4), 1.0, "clopper-pearson", fingers, "finger"
    )
    if pair_limit is None:
        assert found["eer"] is None
    else:
        assert found["eer"] == Interval(
            0.0,
            pytest.approx(pair_limit, abs=1e-4),
            "clopper-pearson",
            fingers // 2,
            "pair of fingers",
        )
    worst, *_ = intervals_of(separated(fingers, sign=-1))
    assert (worst["rank_one"].low, worst["rank_one"].trials) == (0.0, fingers)


def test_300_fingers_are_about_the_rule_of_3():
    many, *_ = intervals_of(separated(300))
    assert many["fmr1000"].high == pytest.approx(3 / 300, rel=0.01)
    assert many["eer"].high == pytest.approx(3 / 150, rel=0.02)


def test_limits_of_several_databases_and_of_their_mean():
    found = intervals_of(separated(12, name="a"), separated(10, 4, name="b"))
    assert [one["eer"].trials for one in found] == [6, 5, 10, 11]
    assert (found[-1]["rank_one"].trials, found[-1]["rank_one"].unit) == (22, "finger")

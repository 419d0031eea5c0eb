import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, binomtest

from fpmatch.lab.evaluation.rates.bootstrap import bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.intervals import ExactBound, Interval, exact_bound, interval_of
from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials, unnamed_set
from fpmatch.lab.evaluation.report.operating_points import rate_intervals
from fpmatch.lab.evaluation.report.score_reports import summarise_scores
from fpmatch.lab.evaluation.run import evaluate

SIDES = ("similarity", "probe", "reference")


def separated(fingers, impressions=2, name="db", sign=1):
    """Return all pairs of some prints, the genuine ones alike; with a sign of -1 the others."""
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    similarity = sign * (finger[i] == finger[j]) + np.linspace(0.0, 0.5, i.size)
    prints = tuple(f"{f}_{k}" for k, f in enumerate(finger))
    trials = Trials(similarity, finger[i], finger[j], fingers)
    return ScoresSet("fake", name, prints, i, j, trials, np.ones(i.size, bool))


def intervals_of(*sets):
    return rate_intervals(summarise_scores(sets), bootstrap=20)


def test_the_rate_lies_within_its_interval(report):
    found = rate_intervals(report, bootstrap=300)
    for row, intervals in zip(report.sets, found.sets, strict=True):
        assert intervals.eer.low <= row.rates.eer <= intervals.eer.high
        assert intervals.eer.low < intervals.eer.high
        assert intervals.rank_one.low <= row.rank_one <= intervals.rank_one.high
        assert intervals.fmr1000 is None
    assert found.mean.eer.low <= report.mean.eer <= found.mean.eer.high
    assert found.pooled.eer.low <= report.pooled.eer <= found.pooled.eer.high
    assert found.pooled.rank_one.low <= report.rank_one <= found.pooled.rank_one.high


def test_the_seed_makes_the_draws_and_json_has_pairs_of_limits(report):
    first, again, other = (rate_intervals(report, bootstrap=50, seed=s) for s in (1, 1, 2))
    assert first == again
    assert first.pooled != other.pooled
    document = json.loads(json.dumps(first.as_json()))
    assert list(document) == [
        *("confidence", "method", "bootstrap", "seed", "sets", "mean", "pooled")
    ]
    assert (document["confidence"], document["method"]) == (0.95, "bootstrap")
    assert document["pooled"]["eer"] == list(first.pooled.eer)
    assert document["sets"][1]["fmr10000"] is None


def test_few_fingers_have_no_interval_and_the_fvc_protocol_no_rank(options, make_database):
    folders = [make_database("few", fingers=4), make_database("enough", fingers=5)]
    found = rate_intervals(evaluate(folders, **options), bootstrap=50)
    assert [one.eer is None for one in (*found.sets, found.mean, found.pooled)] == [1, 0, 1, 1]
    (first,) = rate_intervals(evaluate(folders[1:], protocol="fvc", **options), bootstrap=50).sets
    assert first.rank_one is None
    assert first.eer is not None


def test_draws_without_a_rate_are_left_out_until_too_many():
    draws = np.array([0.1, 0.2, 0.3, np.nan])
    assert interval_of(draws) == Interval(pytest.approx(0.105), pytest.approx(0.295))
    assert interval_of(np.array([0.1, np.nan])) is None


def test_trials_number_the_fingers_from_0(report):
    found = report.sets[0].scores.trials
    assert (found.fingers, set(found.probe)) == (8, set(range(8)))
    assert (found.genuine == report.sets[0].pairs.genuine).all()


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
    ("fingers", "pairs", "finger_limit", "pair_limit"),
    [(3, 1, 0.6316, 0.95), (4, 2, 0.5271, 0.7764), (10, 5, 0.2589, 0.4507)],
)
def test_no_error_has_an_upper_limit_by_fingers(fingers, pairs, finger_limit, pair_limit):
    (found,) = intervals_of(separated(fingers)).sets
    assert found.eer == (0.0, pytest.approx(pair_limit, abs=1e-4))
    assert found.rank_one == (pytest.approx(1 - finger_limit, abs=1e-4), 1.0)
    assert found.bounds["eer"] == ExactBound("pair of fingers", pairs)
    assert found.bounds["rank_one"] == ExactBound("finger", fingers)
    (worst,) = intervals_of(separated(fingers, sign=-1)).sets
    assert worst.eer == (pytest.approx(1 - pair_limit, abs=1e-4), 1.0)
    assert worst.rank_one == (0.0, pytest.approx(finger_limit, abs=1e-4))


@pytest.mark.parametrize("units", [1, 2, 7, 300, 10**6])
def test_the_limit_is_that_of_clopper_and_pearson(units):
    none, all_ = (ExactBound("finger", units).interval(rate) for rate in (0.0, 1.0))
    for limits, count, side in ((none, 0, "less"), (all_, units, "greater")):
        exact = binomtest(count, units, alternative=side).proportion_ci(0.95, method="exact")
        assert limits == pytest.approx(tuple(exact), rel=1e-9)


def test_one_finger_with_genuine_pairs_is_one_trial_and_300_are_about_the_rule_of_3():
    names = ("1_1", "1_2", "2_1")
    one = Trials(np.array([9.0, 1.0, 0.5]), np.array([0, 0, 0]), np.array([0, 1, 1]), 2)
    both = np.array([0, 0, 1]), np.array([1, 2, 2])
    (found,) = intervals_of(ScoresSet("fake", "one", names, *both, one, np.ones(3, bool))).sets
    assert found.eer == (0.0, pytest.approx(0.95))
    (many,) = intervals_of(separated(300)).sets
    assert many.fmr1000.high == pytest.approx(3 / 300, rel=0.01)
    assert many.eer.high == pytest.approx(3 / 150, rel=0.02)


def test_limits_of_several_databases_and_of_their_mean():
    found = intervals_of(separated(10, name="a"), separated(6, 4, name="b"))
    assert [one.bounds["eer"].units for one in (*found.sets, found.mean, found.pooled)] == [
        *(5, 3, 6, 8)
    ]
    assert found.pooled.bounds["rank_one"] == ExactBound("finger", 16)


def test_unknown_fingers_are_bounded_by_comparisons():
    (found,) = intervals_of(unnamed_set(np.ones(50), np.linspace(0.0, 0.5, 300))).sets
    assert found.bounds == dict.fromkeys(("eer", "fmr100"), ExactBound("comparison", 50))


def test_pairs_that_share_one_finger_are_one_trial():
    many = np.arange(1, 9)
    star = Trials(np.zeros(8), np.zeros(8, int), many, 9)
    genuine = Trials(np.ones(9), np.arange(9), np.arange(9), 9)
    both = Trials(*(np.concatenate([getattr(star, n), getattr(genuine, n)]) for n in SIDES), 9)
    assert exact_bound("eer", [both]) == ExactBound("pair of fingers", 1)
    assert exact_bound("fmr100", [both]) == ExactBound("finger", 9)


def test_databases_of_one_kind_of_pair_have_limits_together():
    genuine, impostor = separated(6), separated(8, name="b")
    sets = [
        replace(
            one,
            **{name: getattr(one, name)[kept] for name in ("probe", "reference", "compared")},
            trials=replace(one.trials, **{n: getattr(one.trials, n)[kept] for n in SIDES}),
        )
        for one, kept in ((genuine, genuine.trials.genuine), (impostor, ~impostor.trials.genuine))
    ]
    found = intervals_of(*sets)
    assert [one.eer for one in (*found.sets, found.mean)] == [None] * 3
    assert found.pooled.bounds["eer"] == ExactBound("pair of fingers", 4)


def test_an_error_keeps_the_interval_of_the_bootstrap(report):
    for found in rate_intervals(report, bootstrap=50).sets:
        assert "eer" not in found.bounds


@given(st.integers(1, 100_000), st.integers(1, 1000))
def test_a_limit_is_never_0_and_falls_with_the_trials(units, more):
    few, many = (ExactBound("finger", n).interval(0.0) for n in (units, units + more))
    assert few.low == many.low == 0.0
    assert 0.0 < many.high < few.high < 1.0
    mirrored = ExactBound("finger", units).interval(1.0)
    assert mirrored == (pytest.approx(1 - few.high), 1.0)


@given(st.integers(1, 2000), st.floats(0.0, 1.0))
def test_a_limit_holds_with_a_probability_of_at_least_95_percent(units, truth):
    limit = ExactBound("finger", units).interval(0.0).high
    missed = binom.pmf(0, units, truth) if truth > limit else 0.0
    assert missed <= 0.05 + 1e-9


def test_pairs_of_fingers_are_the_trials_where_few_fingers_match_all_others():
    # No error is seen where none of the fingers is one of the share that matches every other.
    share = np.linspace(0.001, 0.5, 500)
    fmr, unseen = 1 - (1 - share) ** 2, (1 - share) ** 20

    def most_missed(bound):
        return unseen[fmr > bound.interval(0.0).high].max()

    assert most_missed(exact_bound("eer", [separated(20).trials])) <= 0.05
    assert most_missed(ExactBound("finger", 20)) > 0.2

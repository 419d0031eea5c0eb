import numpy as np
import pytest
from scipy.stats import binomtest

from fpmatch.lab.evaluation.rates.bootstrap import (
    bootstrap_rates,
    interval_of,
    with_limit,
)
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.scores import ScoresSet, Trials
from fpmatch.lab.evaluation.report.results import RatesReport, SetRates, report_document
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
    known = report_document([report], bootstrap=20)["intervals"]
    return [*known["sets"], known["mean"], known["pooled"]]


def test_the_rate_lies_within_its_interval(report):
    known = report_document([report], bootstrap=300)["intervals"]
    for row, intervals in zip(report.sets, known["sets"], strict=True):
        assert intervals["eer"][0] < row.rates.eer < intervals["eer"][1]
        assert intervals["fmr1000"] is None
    for part, eer in (("mean", report.mean.eer), ("pooled", report.pooled.eer)):
        assert known[part]["eer"][0] <= eer <= known[part]["eer"][1]


def test_the_seed_makes_the_draws_and_json_has_pairs_of_limits(report):
    first, again, other = (
        report_document([report], bootstrap=50, seed=s)["intervals"] for s in (1, 1, 2)
    )
    assert first == again
    assert first["pooled"] != other["pooled"]
    assert (first["confidence"], first["method"]) == (0.95, "bootstrap")
    assert first["sets"][1]["fmr10000"] is None


def test_few_fingers_have_no_interval(options, make_database):
    folders = [make_database("few", fingers=4), make_database("enough", fingers=5)]
    found = report_document([evaluate(folders, **options)], bootstrap=50)["intervals"]
    parts = (*found["sets"], found["mean"], found["pooled"])
    assert [one["eer"] is None for one in parts] == [1, 0, 1, 1]


def test_draws_without_a_rate_are_left_out_until_too_many():
    draws = np.array([0.1, 0.2, 0.3, np.nan])
    assert interval_of(draws) == pytest.approx([0.105, 0.295])
    assert interval_of(np.array([0.1, np.nan])) is None


def test_the_wider_of_two_intervals_counts():
    drawn, limit = [0.0, 0.5], with_limit(None, 0.0, 10, "finger")
    for rate in (0.0, 0.1):
        assert with_limit(drawn, rate, 10, "finger") == (drawn, None)
    assert with_limit([0.0, 0.0], 0.0, 10, "finger") == limit
    assert with_limit(None, 0.0, 0, "finger") == (None, None)


@pytest.mark.parametrize("units", [1, 2, 7, 300, 10**6])
def test_the_limit_is_that_of_clopper_and_pearson(units):
    for rate, count, side in ((0.0, 0, "less"), (1.0, units, "greater")):
        found, _ = with_limit(None, rate, units, "finger")
        exact = binomtest(count, units, alternative=side).proportion_ci(0.95, method="exact")
        assert found == pytest.approx(list(exact), rel=1e-9)


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
    draws = [bootstrap_rates([world(25, 4)], 100, seed=k)[1][:, 0] for k in range(40)]
    intervals = [interval_of(one) for one in draws]
    assert sum(low <= truth <= high for low, high in intervals) >= 33


def test_a_rate_of_0_or_1_has_a_limit_by_fingers_and_no_eer_one_above_half():
    found, *_ = intervals_of(separated(10))
    assert found["fmr100"] == [0.0, pytest.approx(0.2589, abs=1e-4)]
    assert found["eer"] == [0.0, pytest.approx(0.4507, abs=1e-4)]
    by = {"method": "clopper-pearson"}
    units = {"eer": {"unit": "pair of fingers", "units": 5} | by}
    assert found["bounds"] == units | {"fmr100": {"unit": "finger", "units": 10} | by}
    worst, *_ = intervals_of(separated(10, sign=-1))
    assert worst["fmr100"] == [pytest.approx(0.7411, abs=1e-4), 1.0]
    assert intervals_of(separated(3))[0]["eer"] is None


def test_limits_of_several_databases_and_of_their_mean():
    found = intervals_of(separated(12, name="a"), separated(10, 4, name="b"))
    assert [one["bounds"]["eer"]["units"] for one in found] == [6, 5, 10, 11]
    assert found[-1]["bounds"]["fmr100"]["units"] == 22

import json

import numpy as np
import pytest

from fpmatch.evaluation.bootstrap import bootstrap_rates
from fpmatch.evaluation.intervals import Interval, interval_of, rate_intervals
from fpmatch.evaluation.ranked_trials import Trials
from fpmatch.evaluation.rates import error_rates
from fpmatch.evaluation.run import evaluate


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
    assert list(document) == ["confidence", "bootstrap", "seed", "sets", "mean", "pooled"]
    assert document["confidence"] == 0.95
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

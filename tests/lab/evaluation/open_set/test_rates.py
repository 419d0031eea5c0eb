"""FNIR and FPIR of a few searches, counted by hand and by trying every threshold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.evaluation.open_set.rates import open_set_rates, predicted_threshold
from fpmatch.lab.evaluation.open_set.searches import LIST_LENGTH, NO_SCORE, NOT_LISTED, Searches
from fpmatch.lab.evaluation.rates.intervals import ExactBound
from fpmatch.matching.calibration import Calibration

TEN_PER_TEN = Calibration(((0.0, 0.0), (60.0, 60.0)), tail_scale=1.0)


def searches_of(scores, ranks, highest, enrolled=10):
    return Searches(
        mated=np.arange(len(scores)),
        score=np.array(scores, float),
        rank=np.array(ranks, int),
        direct=np.array(scores, float),
        nonmated=np.arange(len(highest)),
        highest=np.array(highest, float),
        enrolled=np.full(3, enrolled),
        compared=np.full(3, enrolled),
        preselected=False,
    )


def rates_of(searches, **options):
    most = max(len(searches.mated), len(searches.nonmated))
    return open_set_rates(searches, np.arange(most), TEN_PER_TEN, **options)


def test_rates_of_a_few_searches_counted_by_hand():
    searches = searches_of(
        [50.0, 40.0, 30.0, NO_SCORE], [1, 1, 3, NOT_LISTED], [10.0, 20.0, 35.0, 45.0]
    )
    rates = rates_of(searches, fpirs=[0.25, 0.5, 0.75, 0.1])
    # one of four may have a candidate: the threshold lies above 35: 50 and 40 are found
    assert [point.fnir for point in rates.points] == [0.5, 0.25, 0.25, None]
    assert [point.threshold for point in rates.points] == [35.0, 20.0, 10.0, None]
    assert [point.false_positives for point in rates.points] == [1, 2, 3, None]
    assert rates.fnir_at_rank[:4] == (0.5, 0.5, 0.25, 0.25)
    assert len(rates.fnir_at_rank) == LIST_LENGTH
    assert (rates.mated, rates.nonmated) == (4, 4)
    assert all(point.interval is None for point in rates.points)


def test_what_1_to_1_predicts_is_counted_at_the_fmr_of_n_comparisons():
    # of 1,000 subjects, each at an FMR of 1.0e-5, one in a hundred searches has a candidate
    assert predicted_threshold(0.01, 1000) == pytest.approx(50.0, abs=0.03)
    fmr = 10 ** (-predicted_threshold(0.2, 17) / 10)
    assert 1 - (1 - fmr) ** 17 == pytest.approx(0.2)
    searches = searches_of([60.0, 49.0, 10.0], [1, 1, 1], [0.0] * 100, enrolled=1000)
    near, far = rates_of(searches, fpirs=[0.01, 0.0001]).points
    assert near.predicted_fnir == pytest.approx(2 / 3)
    assert not near.extrapolated
    assert far.extrapolated
    assert far.predicted_threshold > 60.0


SCORE = st.integers(0, 20).map(float)
MATE = st.one_of(st.tuples(SCORE, st.integers(1, 100)), st.just((NO_SCORE, NOT_LISTED)))


@given(
    st.lists(MATE, min_size=1, max_size=12),
    st.lists(st.one_of(SCORE, st.just(NO_SCORE)), min_size=1, max_size=12),
)
def test_agrees_with_trying_every_threshold(mates, highest):
    scores, ranks = np.array(mates).T
    fpirs = np.linspace(0.05, 0.95, 19)
    rates = rates_of(searches_of(scores, ranks, highest), fpirs=fpirs)
    thresholds = [*np.arange(0, 22) - 0.5]
    for point in rates.points:
        if point.fpir * len(highest) < 1 - 1e-9:
            assert point.fnir is None
            continue
        allowed = [t for t in thresholds if np.mean(np.array(highest) >= t) <= point.fpir + 1e-9]
        assert point.fnir == pytest.approx(min(np.mean(scores < t) for t in allowed))
    for rank, fnir in enumerate(rates.fnir_at_rank, start=1):
        assert fnir == pytest.approx(np.mean(ranks > rank))
    known = [point.fnir for point in rates.points if point.fnir is not None]
    assert known == sorted(known, reverse=True)
    assert list(rates.fnir_at_rank) == sorted(rates.fnir_at_rank, reverse=True)
    predicted = [point.predicted_fnir for point in rates.points]
    assert predicted == sorted(predicted, reverse=True)


def test_intervals_contain_the_rates_and_need_five_subjects():
    rng = np.random.default_rng(0)
    scores = rng.uniform(20, 60, 200)
    searches = searches_of(scores, np.where(scores < 25, 2, 1), rng.uniform(0, 30, 400))
    subject = np.arange(400) // 10
    draws = rng.multinomial(40, np.full(40, 1 / 40), size=300)
    rates = open_set_rates(searches, subject, TEN_PER_TEN, draws=draws)
    for point in (*rates.points[1:], *rates.det):
        assert point.interval.low <= point.fnir <= point.interval.high
    assert rates.points[0].interval is None  # of 400 searches, not one may have a candidate
    low, high = rates.rank_intervals[0]
    assert low < rates.fnir_at_rank[0] < high
    few = np.where(np.arange(40) < 4, draws, 0)
    none = open_set_rates(searches, subject, TEN_PER_TEN, draws=few)
    assert all(point.interval is None for point in none.points if point.fnir)
    assert none.rank_intervals[0] is None
    assert none.fnir_at_rank[1] == 0


@pytest.mark.parametrize(
    ("subjects", "limit"), [(1, 0.95), (3, 0.6316), (300, pytest.approx(3 / 300, rel=0.01))]
)
def test_no_miss_has_an_upper_limit_by_subjects(subjects, limit):
    mated = subjects * 4
    searches = searches_of([50.0] * mated, [1] * mated, [10.0] * mated)
    draws = np.ones((20, subjects), np.int64)
    rates = open_set_rates(searches, np.arange(mated) // 4, TEN_PER_TEN, fpirs=[0.5], draws=draws)
    (point,) = rates.points
    assert point.interval == (0.0, pytest.approx(limit, abs=1e-4))
    assert point.bound == rates.rank_bounds[0] == ExactBound("subject", subjects)
    assert rates.rank_intervals[0] == point.interval
    assert rates.as_json()["rank_bounds"][0]["method"] == "clopper-pearson"
    missed = searches_of([5.0] * mated, [7] * mated, [10.0] * mated)
    worst = open_set_rates(missed, np.arange(mated) // 4, TEN_PER_TEN, fpirs=[0.5], draws=draws)
    assert worst.points[0].interval == (pytest.approx(1 - point.interval.high), 1.0)
    without = open_set_rates(searches, np.arange(mated) // 4, TEN_PER_TEN, fpirs=[0.5])
    assert without.points[0].interval is without.rank_intervals[0] is None


def test_draws_of_every_subject_once_have_the_rates_themselves():
    rng = np.random.default_rng(1)
    searches = searches_of(rng.uniform(0, 60, 100), np.ones(100), rng.uniform(0, 40, 200))
    once = np.ones((7, 200), np.int64)
    rates = open_set_rates(searches, np.arange(200), TEN_PER_TEN, draws=once)
    for point in rates.det:
        assert point.interval == (point.fnir, point.fnir)


def test_a_database_without_mates_has_no_fnir():
    rates = rates_of(searches_of([], [], [1.0, 2.0]), fpirs=[0.5])
    assert rates.points[0].fnir is None
    assert rates.points[0].predicted_fnir is None
    assert rates.fnir_at_rank == ()

import itertools
import math
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.point_match import share_of
from research.points.conditions import PAPER_ROWS, TARGET_FACTORS, Condition, conditions, make_pair
from research.points.random_sets import (
    POINT_MODELS,
    independent_pair,
    random_pair,
)

seeds = st.integers(0, 2**32 - 1)
models = st.sampled_from(POINT_MODELS)
sizes = st.integers(1, 60).flatmap(lambda m: st.tuples(st.just(m), st.integers(m, 8 * m)))
every_model = pytest.mark.parametrize("model", POINT_MODELS)


def in_frame_of_q(pair):
    return pair.transform.apply(pair.p)


def partner_distances(pair):
    shift = in_frame_of_q(pair)[pair.pairs[:, 0]] - pair.q[pair.pairs[:, 1]]
    return np.hypot(*shift.T)


@given(sizes, st.floats(0, 1), st.floats(0, 1), models, seeds)
def test_sizes_share_pairs_and_jitter_are_as_requested(size, rho, eta, model, seed):
    m, n = size
    pair = random_pair(m, n, rho, eta, 0.61, model=model, rng=seed)
    assert (pair.p.shape, pair.q.shape, pair.pairs.dtype) == ((m, 2), (n, 2), np.int32)
    assert rho * m - 1e-6 <= len(pair.pairs) < rho * m + 1
    of_p, of_q = pair.pairs.T.tolist()
    assert of_p == sorted(set(of_p))
    assert len(set(of_q)) == len(of_q)
    assert pair.jitter == eta / 2  # one point a unit of area
    if len(pair.pairs):
        assert partner_distances(pair).max() <= pair.jitter + 1e-9


@every_model
def test_jitter_is_uniform_over_the_disc(model):
    pair = random_pair(4000, 4000, 1.0, 0.4, 0.84, model=model, rng=1)
    share_within = (partner_distances(pair) / pair.jitter) ** 2  # uniform in [0, 1]
    quartiles = np.quantile(share_within, [0.25, 0.5, 0.75])
    assert quartiles == pytest.approx([0.25, 0.5, 0.75], abs=0.03)


@given(seeds, models)
def test_the_same_seed_gives_the_same_pair(seed, model):
    first, again, other = (
        random_pair(20, 50, 0.6, 0.25, 0.61, model=model, rng=rng)
        for rng in (seed, np.random.default_rng(seed), seed + 1)
    )
    for one, same in zip(astuple(first), astuple(again), strict=True):
        assert np.array_equal(one, same)
    assert not np.array_equal(first.q, other.q)


@every_model
def test_q_has_one_point_a_unit_of_area_everywhere(model):
    side = 20
    counts = np.zeros((4, 4))
    for seed in range(100):
        q = random_pair(100, side * side, 0.6, 0.25, 0.61, model=model, rng=seed).q
        assert q.min() >= 0
        assert q.max() <= side
        counts += np.histogram2d(*q.T, bins=4, range=[[0, side], [0, side]])[0]
    assert counts / 100 == pytest.approx(np.full((4, 4), 25), rel=0.1)


@given(seeds, models)
def test_outliers_are_no_partners_and_points_stand_in_random_order(seed, model):
    pair = random_pair(50, 100, 0.5, 0.0, 0.61, model=model, rng=seed)
    outliers = np.setdiff1d(np.arange(50), pair.pairs[:, 0])
    distances = np.hypot(*(in_frame_of_q(pair)[outliers, None] - pair.q[None]).transpose(2, 0, 1))
    assert distances.min() > 1e-9
    for order, size in zip(pair.pairs.T, (50, 100), strict=True):
        assert order.min() < size / 2 < order.max()


@every_model
def test_independent_sets_have_no_truth(model):
    pair = independent_pair(50, 100, 0.61, model=model, rng=3)
    assert (pair.p.shape, pair.q.shape, pair.pairs.shape) == ((50, 2), (100, 2), (0, 2))
    assert pair.transform is None
    assert pair.tolerance == pytest.approx(0.305)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 5, 0.5, 0.1, 0.4), "1 to n points"),
        ((6, 5, 0.5, 0.1, 0.4), "1 to n points"),
        ((5, 5, 1.5, 0.1, 0.4), "rho"),
        ((5, 5, math.nan, 0.1, 0.4), "rho"),
        ((5, 5, 0.5, -0.1, 0.4), "eta"),
        ((5, 5, 0.5, 0.1, math.inf), "lambda"),
    ],
)
def test_refuses_parameters_outside_their_range(arguments, message):
    with pytest.raises(PointSetError, match=message):
        random_pair(*arguments, rng=1)
    with pytest.raises(PointSetError, match="unknown model 'both'"):
        independent_pair(5, 5, 0.4, model="both", rng=1)


SMALL = Condition("patch", 5, 2)


def test_there_are_39_conditions_a_model_in_the_order_of_the_tables():
    everywhere = conditions()
    assert len(everywhere) == len(set(everywhere)) == 78
    assert [condition.model for condition in everywhere[::39]] == list(POINT_MODELS)
    for model in POINT_MODELS:
        expected = [(row.m, row.m * f) for row in PAPER_ROWS for f in TARGET_FACTORS]
        assert [(condition.m, condition.n) for condition in conditions([model])] == expected
    assert {condition.m for condition in conditions(largest_m=100)} == {50, 100}
    assert len(conditions(["patch"], 100)) == 18
    assert str(SMALL) == "patch, rho 0.6, m 50, n 100"


def test_a_pair_is_that_of_its_condition():
    pair, row = make_pair(SMALL, 0, 0, genuine=True), SMALL.parameters
    assert (len(pair.p), len(pair.q), len(pair.pairs)) == (50, 100, share_of(row.rho, 50))
    assert pair.tolerance == pytest.approx(row.lambda_ / 2)
    assert pair.jitter == pytest.approx(row.eta / 2)
    independent = make_pair(SMALL, 0, 0, genuine=False)
    assert independent.transform is None
    assert len(independent.pairs) == 0
    assert independent.tolerance == pair.tolerance


def test_every_trial_has_a_seed_of_its_own():
    elsewhere = [Condition("clutter", 5, 2), Condition("patch", 9, 2), Condition("patch", 5, 4)]
    keys = list(itertools.product((SMALL, *elsewhere), (0, 1), (0, 1), (True, False)))
    pairs, again = (
        [make_pair(c, seed, trial, genuine=genuine) for c, seed, trial, genuine in keys]
        for _ in range(2)
    )
    assert len({pair.q.tobytes() for pair in pairs}) == len(pairs)
    for one, other in zip(pairs, again, strict=True):
        np.testing.assert_array_equal(one.p, other.p)
        np.testing.assert_array_equal(one.q, other.q)


@pytest.mark.parametrize(
    ("other", "harder"),
    [
        (Condition("patch", 5, 4), True),
        (Condition("patch", 6, 2), True),
        (Condition("patch", 6, 8), True),
        (Condition("patch", 5, 2), False),
        (Condition("clutter", 5, 4), False),
        (Condition("patch", 9, 4), False),
        (Condition("patch", 0, 8), False),
    ],
)
def test_harder_means_larger_sets_and_nothing_else(other, harder):
    assert other.is_harder_than(SMALL) is harder
    assert not SMALL.is_harder_than(other)
    assert not Condition("patch", 6, 2).is_harder_than(Condition("patch", 5, 8))


@pytest.mark.parametrize(("table", "mean"), [("van_wamelen_s", 1.4113), ("unit_circle_s", 0.0022)])
def test_the_papers_times_have_its_means_and_grow_with_either_set(table, mean):
    times = np.array([getattr(row, table) for row in PAPER_ROWS])
    assert times[:, 0].mean() == pytest.approx(mean, abs=1e-4 if mean > 1 else 5e-5)
    assert times.shape == (len(PAPER_ROWS), len(TARGET_FACTORS))
    assert (np.diff(times, axis=1) > 0).all()
    for rho in (0.95, 0.6, 0.9):
        assert (np.diff(times[[row.rho == rho for row in PAPER_ROWS]], axis=0) > 0).all()

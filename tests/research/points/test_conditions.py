import itertools

import numpy as np
import pytest

from fpmatch.pointset.geometry.point_match import share_of
from research.points.conditions import PAPER_ROWS, TARGET_FACTORS, Condition, conditions, make_pair
from research.points.random_sets import POINT_MODELS

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

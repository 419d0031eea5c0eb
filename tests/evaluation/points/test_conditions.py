"""The conditions of the experiment, and the seeds of its trials."""

from __future__ import annotations

import numpy as np
import pytest

from fpmatch.evaluation.points.conditions import Condition, conditions, make_pair
from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.pointset.point_match import share_of
from fpmatch.pointset.random_sets import POINT_MODELS

SMALL = Condition("patch", 5, 2)


def test_there_are_39_conditions_a_model_in_the_order_of_the_tables() -> None:
    everywhere = conditions()
    assert len(everywhere) == len(set(everywhere)) == 78
    assert [condition.model for condition in everywhere[::39]] == list(POINT_MODELS)
    for model in POINT_MODELS:
        expected = [(row.m, row.m * f) for row in PAPER_ROWS for f in TARGET_FACTORS]
        assert [(condition.m, condition.n) for condition in conditions([model])] == expected


def test_rows_with_more_points_can_be_left_out() -> None:
    assert {condition.m for condition in conditions(largest_m=100)} == {50, 100}
    assert len(conditions(["patch"], 100)) == 18


def test_a_condition_has_a_name() -> None:
    assert str(SMALL) == "patch, rho 0.6, m 50, n 100"


def test_a_pair_is_that_of_its_condition() -> None:
    pair = make_pair(SMALL, 0, 0, genuine=True)
    row = SMALL.parameters
    assert (len(pair.p), len(pair.q), len(pair.pairs)) == (50, 100, share_of(row.rho, 50))
    assert pair.tolerance == pytest.approx(row.lambda_ / 2)
    assert pair.jitter == pytest.approx(row.eta / 2)


def test_an_independent_pair_has_no_truth() -> None:
    pair = make_pair(SMALL, 0, 0, genuine=False)
    assert pair.transform is None
    assert len(pair.pairs) == 0
    assert pair.tolerance == pytest.approx(SMALL.parameters.lambda_ / 2)


@pytest.mark.parametrize("genuine", [True, False])
def test_a_trial_is_the_same_each_time(genuine: bool) -> None:
    first, again = (make_pair(SMALL, 7, 3, genuine=genuine) for _ in range(2))
    np.testing.assert_array_equal(first.p, again.p)
    np.testing.assert_array_equal(first.q, again.q)


def test_every_trial_has_a_seed_of_its_own() -> None:
    pairs = [
        make_pair(condition, seed, trial, genuine=genuine)
        for condition in (
            SMALL,
            Condition("clutter", 5, 2),
            Condition("patch", 9, 2),
            Condition("patch", 5, 4),
        )
        for seed in (0, 1)
        for trial in (0, 1)
        for genuine in (True, False)
    ]
    assert len({pair.q.tobytes() for pair in pairs}) == len(pairs)


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
def test_harder_means_larger_sets_and_nothing_else(other: Condition, harder: bool) -> None:
    assert other.is_harder_than(SMALL) is harder
    assert not SMALL.is_harder_than(other)


def test_fewer_points_of_q_are_not_harder() -> None:
    assert not Condition("patch", 6, 2).is_harder_than(Condition("patch", 5, 8))

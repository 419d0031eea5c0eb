"""The places of the experiment, and the seeds of its trials."""

from __future__ import annotations

import numpy as np
import pytest

from fpmatch.evaluation.points.places import Place, make_pair, places
from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.pointset.point_match import share_of
from fpmatch.pointset.random_sets import READINGS

SMALL = Place("patch", 5, 2)


def test_there_are_39_places_a_reading_in_the_order_of_the_tables() -> None:
    everywhere = places()
    assert len(everywhere) == len(set(everywhere)) == 78
    assert [place.reading for place in everywhere[::39]] == list(READINGS)
    for reading in READINGS:
        expected = [(row.m, row.m * f) for row in PAPER_ROWS for f in TARGET_FACTORS]
        assert [(place.m, place.n) for place in places([reading])] == expected


def test_rows_with_more_points_can_be_left_out() -> None:
    assert {place.m for place in places(largest_m=100)} == {50, 100}
    assert len(places(["patch"], 100)) == 18


def test_a_place_says_where_it_is() -> None:
    assert str(SMALL) == "patch, rho 0.6, m 50, n 100"


def test_a_pair_is_that_of_its_place() -> None:
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
        make_pair(place, seed, trial, genuine=genuine)
        for place in (SMALL, Place("clutter", 5, 2), Place("patch", 9, 2), Place("patch", 5, 4))
        for seed in (0, 1)
        for trial in (0, 1)
        for genuine in (True, False)
    ]
    assert len({pair.q.tobytes() for pair in pairs}) == len(pairs)


@pytest.mark.parametrize(
    ("other", "harder"),
    [
        (Place("patch", 5, 4), True),
        (Place("patch", 6, 2), True),
        (Place("patch", 6, 8), True),
        (Place("patch", 5, 2), False),
        (Place("clutter", 5, 4), False),
        (Place("patch", 9, 4), False),
        (Place("patch", 0, 8), False),
    ],
)
def test_harder_means_larger_sets_and_nothing_else(other: Place, harder: bool) -> None:
    assert other.is_harder_than(SMALL) is harder
    assert not SMALL.is_harder_than(other)


def test_fewer_points_of_q_are_not_harder() -> None:
    assert not Place("patch", 6, 2).is_harder_than(Place("patch", 5, 8))

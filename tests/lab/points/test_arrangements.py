"""Arrangements of points: the work of a match is bounded, and what can be found is found."""

import numpy as np
import pytest
from arranged_sets import (
    ARRANGEMENTS,
    COPIED,
    INDEPENDENT,
    arranged_part,
    copied_pair,
    independent_sets,
)
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import grid_of, seeds, squared_distances

from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.triangles import matcher as triangles
from fpmatch.pointset.geometry import _grid_kernel as grid_kernel
from fpmatch.pointset.geometry.similarity import Similarity

POINTS = 150
COPIES, PAIRS = 4, 2

pytestmark = pytest.mark.skipif(
    not grid_kernel.COMPILED, reason="interpreted, a search of millions of steps takes minutes"
)


@pytest.fixture
def searches(monkeypatch):
    """Return the searches that the matchers make from now on."""
    made = []
    begin = triangles._Search.__init__

    def noted(self, *arguments):
        begin(self, *arguments)
        made.append(self)

    monkeypatch.setattr(triangles._Search, "__init__", noted)
    return made


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_work_is_bounded_and_bounds_leave_uniform_sets_alone(name, searches):
    rng = np.random.default_rng(0)
    match = match_points(*(ARRANGEMENTS[name](rng, POINTS) for _ in "pq"))
    assert (match.transform is None) == bool(match.reason)
    assert searches
    for search in searches:
        # one proposal more may be tested, grown and refined when the bound is reached
        assert search.visits[0] <= search.max_visits + 32 * POINTS
        if name == "uniform":
            assert search.visits[0] < search.max_visits / 2
            assert search.passed * POINTS < 50_000


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_a_part_is_found_in_every_arrangement(name):
    p, q, truth = arranged_part(name, POINTS)
    found = match_points(p, q)
    assert found.matched_share > 0.75
    error = np.hypot(*(found.transform.apply(p) - truth.apply(p)).T)
    assert np.median(error) < 1e-3 * np.ptp(q)


@pytest.mark.slow
def test_a_long_search_does_not_map_a_crowd_onto_a_crowd():
    rng = np.random.default_rng(0)
    match = match_points(*(ARRANGEMENTS["one cluster"](rng, 20_000) for _ in "pq"))
    assert match.transform is None
    assert "ended at its limit" in match.reason


def crowd(seed, count, outliers=2):
    """Return points (2, N): most in a small cluster, repeated ones among them."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 1e-3, (2, count)).round(rng.choice([3, 4, 9]))
    points[:, :outliers] = rng.uniform(-100, 100, (2, outliers))
    return points


@given(seeds, st.integers(17, 300), st.sampled_from([0.0, 1e-4, 1e-3, 0.5, 1e100]))
def test_split_crowds_are_searched_as_if_they_were_not_split(seed, count, reach):
    points = crowd(seed, count)
    grid = grid_of(points, 50.0)
    grid.split_crowds()
    assert sorted(grid.order) == list(range(count))
    assert points[:, np.asarray(grid.order)].tolist() == [list(grid.x), list(grid.y)]
    rng = np.random.default_rng(seed)
    near, distance2 = np.empty(5, np.int32), np.empty(5)
    for place in (*points.T[:3], *points.T[-3:], *rng.normal(0, 2e-3, (4, 2)), [np.nan, 0.0]):
        squared = squared_distances(grid, *place)
        found = grid.nearest(*place, reach**2)
        assert (found >= 0) == (squared < reach**2).any()
        assert found < 0 or squared[found] == squared.min()
        if not np.isnan(place).any():
            number = grid.within(*place, reach**2, 5, near, distance2, 0)
            expected = np.sort(squared[squared <= reach**2])[:5]
            assert distance2[:number].tolist() == expected.tolist()
            assert squared[near[:number]].tolist() == expected.tolist()


@pytest.mark.parametrize("kind", COPIED)
def test_a_copy_gets_the_true_map_and_all_pairs_a_jittered_one_that_or_none(kind):
    for seed in range(COPIES):
        p, q, truth = copied_pair(kind, seed)
        match = match_points(p, q)
        assert len(match.pairs) == len(np.unique(p, axis=0))
        assert match.transform.apply(p) == pytest.approx(truth.apply(p), abs=1e-6)
        assert match.chance < 1e-3
        assert match.equal_maps == 1
        p, q, truth = copied_pair(kind, seed, jitter=0.1)
        match = match_points(p, q)
        if match.transform is not None:
            assert np.hypot(*(match.transform.apply(p) - truth.apply(p)).T).max() < 3


@pytest.mark.parametrize("kind", INDEPENDENT)
def test_sets_that_share_a_structure_alone_do_not_match(kind):
    for seed in range(PAIRS):
        p, q = independent_sets(kind, seed)
        match = match_points(p, q)
        assert match.transform is None
        assert match.reason


@pytest.mark.slow
def test_large_sets_of_uneven_density_do_not_match():
    rng = np.random.default_rng(0)
    p, q = rng.normal(0, 5, (2, 5_000, 2))
    assert match_points(p, q).transform is None


@pytest.mark.parametrize(("form", "maps"), [(5, 4), (8, 4), (7j, 7), (24j, 24)])
def test_a_grid_and_a_circle_are_said_to_fit_in_as_many_ways_as_they_do(form, maps):
    p = np.argwhere(np.ones((form, form))) * 15.0 if isinstance(form, int) else circle(maps)
    match = match_points(p, Similarity(1.5, 0.4, 3.0, 4.0).apply(p))
    assert match.equal_maps == maps
    assert f"{maps} maps fit equally well" in match.reason


def circle(number):
    angle = 2 * np.pi * np.arange(number) / number
    return 100 * np.column_stack([np.cos(angle), np.sin(angle)])

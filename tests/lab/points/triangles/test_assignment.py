import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import grid_of, moved, places, seeds

from fpmatch.lab.points.triangles._assignment_kernel import find_candidates
from fpmatch.lab.points.triangles.pairing import MAX_CANDIDATES, optimal_pairs

STAY = np.array([1.0, 0.0, 0.0, 0.0])

pixels = st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=MAX_CANDIDATES).map(
    lambda points: np.array(points, dtype=np.float64).reshape(-1, 2).T.copy()
)
"""Whole pixels (2, N), often coincident, no more than a point may have candidates."""


def gains(p, grid, move, tolerance):
    """Return t² - d² for every pair, 0 where that is less, shape (N of P, M of Q)."""
    image, q = moved(p, move), places(grid)
    squared = ((image[:, :, None] - q[:, None, :]) ** 2).sum(axis=0)
    return np.maximum(tolerance**2 - squared, 0.0)


def best_with_scipy(gain):
    """Return the largest gain in all of a one-to-one pairing, and how many pairs gain something."""
    from scipy.optimize import linear_sum_assignment

    chosen = gain[linear_sum_assignment(gain, maximize=True)]
    return float(chosen.sum()), int((chosen > 0).sum())


def check_with_scipy(p, q, move, tolerance):
    """Check that pairs are one to one, within the tolerance, and of the largest gain."""
    grid = grid_of(q, tolerance)
    gain = gains(p, grid, move, tolerance)
    partner = optimal_pairs(p, grid, move, tolerance)
    assert partner.dtype == np.int32
    paired = np.flatnonzero(partner >= 0)
    assert len(set(partner[paired].tolist())) == len(paired)
    chosen = gain[paired, partner[paired]]
    assert (chosen > 0).all()
    total, pairs = best_with_scipy(gain)
    assert (float(chosen.sum()), len(paired)) == (pytest.approx(total, abs=1e-9), pairs)


@given(seeds, st.integers(0, 24), st.integers(0, 24), st.sampled_from([0.04, 0.2, 0.4]))
def test_random_points_pair_as_scipy_pairs_them(seed, n, m, tolerance):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, n)), rng.uniform(0, 2, (2, m))
    move = np.array([2 * np.cos(0.1), 2 * np.sin(0.1), *rng.uniform(-0.2, 0.2, 2)])
    check_with_scipy(p, q, move, tolerance)


@given(pixels, pixels, st.sampled_from([0.3, 1.05, 1.5, 20.5]))
def test_pixels_pair_as_scipy_pairs_them(p, q, tolerance):
    # with these tolerances, no sum of squared pixels is a multiple of t²: ties have as many pairs
    check_with_scipy(p, q, STAY, tolerance)


def test_those_in_a_row_move_on_so_that_the_last_has_a_partner():
    p = np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    grid = grid_of(np.array([[0.55, 1.55, 2.55], [0.0, 0.0, 0.0]]), 0.9)
    assert optimal_pairs(p, grid, STAY, 0.9).tolist() == [1, 2, 0]


def test_a_pair_just_at_the_tolerance_gains_nothing():
    p, grid = np.zeros((2, 1)), grid_of(np.array([[3.0], [4.0]]), 5.0)
    assert optimal_pairs(p, grid, STAY, 5.0).tolist() == [-1]
    assert optimal_pairs(p, grid, STAY, 5.001).tolist() == [0]


@pytest.mark.parametrize(("n", "m"), [(0, 0), (0, 3), (3, 0)])
def test_nothing_pairs_with_nothing(n, m):
    partner = optimal_pairs(np.zeros((2, n)), grid_of(np.zeros((2, m)), 1.0), STAY, 1.0)
    assert partner.tolist() == [-1] * n


@given(seeds, st.integers(1, 4), st.sampled_from([0.1, 0.4, 2.0]))
def test_candidates_are_the_nearest_within_the_tolerance(seed, most, tolerance):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 6)), rng.uniform(0, 1, (2, 15))
    grid, move = grid_of(q, tolerance), np.array([0.8, 0.3, 0.0, -0.1])
    start = np.empty(7, np.int32)
    near, cost = np.empty(6 * most, np.int32), np.empty(6 * most)
    count = find_candidates(p, grid, move, tolerance**2, most, start, near, cost)
    assert (start[0], start[-1]) == (0, count)
    apart = moved(p, move)[:, :, None] - places(grid)[:, None, :]
    gain = np.maximum(tolerance**2 - (apart**2).sum(axis=0), 0.0)
    for i in range(6):
        of_i = slice(start[i], start[i + 1])
        assert -cost[of_i] == pytest.approx(gain[i, near[of_i]], abs=1e-12)
        in_reach = np.sort(gain[i][gain[i] > 0])[::-1]
        assert -cost[of_i] == pytest.approx(in_reach[:most], abs=1e-12)

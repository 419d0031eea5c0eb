"""The pairing against scipy's assignment on the same costs, and compiled against interpreted."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import seeds

from fpmatch.pointset import _assignment_kernel as kernel
from fpmatch.pointset import pairing
from fpmatch.pointset._grid_kernel import CellGrid
from fpmatch.pointset.grid import sort_into_cells
from fpmatch.pointset.pairing import MAX_CANDIDATES, optimal_pairs

STAY = np.array([1.0, 0.0, 0.0, 0.0])

pixels = st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=MAX_CANDIDATES).map(
    lambda points: np.array(points, dtype=np.float64).reshape(-1, 2).T.copy()
)
"""Whole pixels (2, N), often coincident, no more than a point may have candidates."""


def grid_of(q: np.ndarray, tolerance: float) -> CellGrid:
    low, high = (q.min(axis=1), q.max(axis=1)) if q.size else (np.zeros(2), np.ones(2))
    return sort_into_cells(q, max(tolerance, 0.05), low=tuple(low), high=tuple(high))


def moved(p: np.ndarray, move: np.ndarray) -> np.ndarray:
    a, b, tx, ty = move
    return np.array([[a, -b], [b, a]]) @ p + [[tx], [ty]]


def gains(p: np.ndarray, grid: CellGrid, move: np.ndarray, tolerance: float) -> np.ndarray:
    """Return t² - d² for every pair, 0 where that is less, shape (N of P, M of Q)."""
    image, q = moved(p, move), np.array([grid.x, grid.y])
    squared = ((image[:, :, None] - q[:, None, :]) ** 2).sum(axis=0)
    return np.maximum(tolerance**2 - squared, 0.0)


def best_with_scipy(gain: np.ndarray) -> tuple[float, int]:
    """Return the largest gain in all of a one-to-one pairing, and how many pairs gain something."""
    from scipy.optimize import linear_sum_assignment

    chosen = gain[linear_sum_assignment(gain, maximize=True)]
    return float(chosen.sum()), int((chosen > 0).sum())


def check_sound(partner: np.ndarray, gain: np.ndarray) -> tuple[float, int]:
    """Check that pairs are one to one and within the tolerance; return their gain and number."""
    paired = np.flatnonzero(partner >= 0)
    assert len(set(partner[paired].tolist())) == len(paired)
    chosen = gain[paired, partner[paired]]
    assert (chosen > 0).all()
    return float(chosen.sum()), len(paired)


@given(seeds, st.integers(0, 24), st.integers(0, 24), st.sampled_from([0.02, 0.1, 0.2]))
def test_random_points_pair_as_scipy_pairs_them(
    seed: int, n: int, m: int, tolerance: float
) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, n)), rng.uniform(0, 2, (2, m))
    move = np.array([2 * np.cos(0.1), 2 * np.sin(0.1), *rng.uniform(-0.2, 0.2, 2)])
    grid = grid_of(q, 2 * tolerance)
    gain = gains(p, grid, move, 2 * tolerance)
    partner = optimal_pairs(p, grid, move, 2 * tolerance)
    assert partner.dtype == np.int32
    total, pairs = best_with_scipy(gain)
    assert check_sound(partner, gain) == (pytest.approx(total, abs=1e-12), pairs)


@given(pixels, pixels, st.sampled_from([0.3, 1.05, 1.5]))
def test_pixels_pair_as_scipy_pairs_them(p: np.ndarray, q: np.ndarray, tolerance: float) -> None:
    # with these tolerances, no sum of squared pixels is a multiple of t²: ties have as many pairs
    grid = grid_of(q, tolerance)
    gain = gains(p, grid, STAY, tolerance)
    partner = optimal_pairs(p, grid, STAY, tolerance)
    total, pairs = best_with_scipy(gain)
    assert check_sound(partner, gain) == (pytest.approx(total, abs=1e-9), pairs)


@given(seeds, st.integers(1, 16), st.integers(1, 12))
def test_crowds_pair_as_scipy_pairs_them(seed: int, n: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.integers(0, 10, (2, n)).astype(float), rng.integers(0, 10, (2, m)).astype(float)
    grid = grid_of(q, 20.5)
    gain = gains(p, grid, STAY, 20.5)
    total, pairs = best_with_scipy(gain)
    partner = optimal_pairs(p, grid, STAY, 20.5)
    assert check_sound(partner, gain) == (pytest.approx(total, abs=1e-9), pairs)


def test_both_have_a_partner_where_nearest_first_leaves_one_without() -> None:
    p = np.array([[0.0, 1.0], [0.0, 0.0]])
    grid = grid_of(np.array([[0.6, 1.5], [0.0, 0.0]]), 1.0)
    assert optimal_pairs(p, grid, STAY, 1.0).tolist() == [0, 1]


def test_the_nearer_of_two_ways_is_taken() -> None:
    p = np.array([[0.0, 0.4], [0.0, 0.0]])
    grid = grid_of(np.array([[0.1, 0.5], [0.0, 0.0]]), 1.0)
    assert optimal_pairs(p, grid, STAY, 1.0).tolist() == [0, 1]
    turned_round = np.array([-1.0, 0.0, 0.5, 0.0])
    assert optimal_pairs(p, grid, turned_round, 1.0).tolist() == [1, 0]


def test_those_in_a_row_move_on_so_that_the_last_has_a_partner() -> None:
    p = np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    grid = grid_of(np.array([[0.55, 1.55, 2.55], [0.0, 0.0, 0.0]]), 0.9)
    assert optimal_pairs(p, grid, STAY, 0.9).tolist() == [1, 2, 0]


def test_coincident_points_have_a_partner_each() -> None:
    same = np.ones((2, 5))
    partner = optimal_pairs(same, grid_of(np.ones((2, 3)), 1.0), STAY, 1.0)
    assert sorted(partner.tolist()) == [-1, -1, 0, 1, 2]


def test_a_pair_just_at_the_tolerance_gains_nothing() -> None:
    p, grid = np.zeros((2, 1)), grid_of(np.array([[3.0], [4.0]]), 5.0)
    assert optimal_pairs(p, grid, STAY, 5.0).tolist() == [-1]
    assert optimal_pairs(p, grid, STAY, 5.001).tolist() == [0]


@pytest.mark.parametrize(("n", "m"), [(0, 0), (0, 3), (3, 0)])
def test_nothing_pairs_with_nothing(n: int, m: int) -> None:
    partner = optimal_pairs(np.zeros((2, n)), grid_of(np.zeros((2, m)), 1.0), STAY, 1.0)
    assert partner.tolist() == [-1] * n


@given(seeds, st.integers(1, 4), st.sampled_from([0.1, 0.4, 2.0]))
def test_candidates_are_the_nearest_within_the_tolerance(
    seed: int, most: int, tolerance: float
) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 6)), rng.uniform(0, 1, (2, 15))
    grid, move = grid_of(q, tolerance), np.array([0.8, 0.3, 0.0, -0.1])
    start = np.empty(7, np.int32)
    near, cost = np.empty(6 * most, np.int32), np.empty(6 * most)
    count = kernel.find_candidates(p, grid, move, tolerance**2, most, start, near, cost)
    assert (start[0], start[-1]) == (0, count)
    gain = gains(p, grid, move, tolerance)
    for i in range(6):
        of_i = slice(start[i], start[i + 1])
        assert -cost[of_i] == pytest.approx(gain[i, near[of_i]], abs=1e-12)
        in_reach = np.sort(gain[i][gain[i] > 0])[::-1]
        assert -cost[of_i] == pytest.approx(in_reach[:most], abs=1e-12)


@given(seeds, st.sampled_from([0.1, 0.2]))
@settings(max_examples=15)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int, tolerance: float
) -> None:
    rng = np.random.default_rng(seed)
    p, grid = rng.uniform(0, 1, (2, 24)), grid_of(rng.uniform(0, 1, (2, 24)), tolerance)
    move = np.array([0.98, 0.1, 0.01, -0.05])
    partner = optimal_pairs(p, grid, move, tolerance)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pairing, "kernel", interpreted("_assignment_kernel"))
        assert optimal_pairs(p, grid, move, tolerance).tolist() == partner.tolist()

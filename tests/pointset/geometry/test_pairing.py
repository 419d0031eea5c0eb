import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, crowded_pixels, grid_of, moved, places, seeds

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry._grid_kernel import find_candidates
from fpmatch.pointset.geometry.pairing import greedy_pairs


def greedy(p, q, tolerance):
    """Pair by looking at every pair: the slow, obvious twin."""
    found = []
    for i, (px, py) in enumerate(p.tolist()):
        for j, (qx, qy) in enumerate(q.tolist()):
            distance = float(np.hypot(px - qx, py - qy))
            if distance <= tolerance:
                found.append((distance, px / 2 + qx / 2, py / 2 + qy / 2, i, j))
    chosen = []
    for *_, i, j in sorted(found):
        if all(i != a and j != b for a, b in chosen):
            chosen.append((i, j))
    return sorted(chosen)


@given(crowded_pixels, crowded_pixels, st.sampled_from([0.0, 1.0, 1.5, 2.5, 3.0, np.inf]))
def test_agrees_with_its_twin_either_way_round(p, q, tolerance):
    forth, back = greedy_pairs(p, q, tolerance), greedy_pairs(q, p, tolerance)
    assert forth.tolist() == [*map(list, greedy(p, q, tolerance))]
    assert {*map(tuple, forth.tolist())} == {(i, j) for j, i in back.tolist()}


@given(any_finite_points, any_finite_points, st.floats(0, allow_nan=False))
def test_any_finite_points_are_paired_one_to_one(p, q, tolerance):
    pairs = greedy_pairs(p, q, tolerance)
    assert pairs.dtype == np.int32
    assert len(set(pairs[:, 0].tolist())) == len(set(pairs[:, 1].tolist())) == len(pairs)


def test_nearest_pair_goes_first_and_the_tolerance_is_inclusive():
    assert greedy_pairs([[0, 0], [2, 0]], [[1.5, 0]], 3).tolist() == [[1, 0]]
    assert len(greedy_pairs([[0.1, 0.7]], [[3.1, 4.7]], 5.0)) == 1


@pytest.mark.parametrize(
    ("q", "tolerance", "reason"),
    [([[0, 0]], -1.0, "tolerance"), ([[0, 0]], np.nan, "tolerance"), ([1, 2, 3], 1.0, "^q:")],
)
def test_impossible_input_is_refused(q, tolerance, reason):
    with pytest.raises(PointSetError, match=reason):
        greedy_pairs([[0, 0]], q, tolerance)


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

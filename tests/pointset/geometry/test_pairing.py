import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, crowded_pixels

from fpmatch.errors import PointSetError
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


@pytest.mark.parametrize(
    ("q", "tolerance", "reason"),
    [([[0, 0]], -1.0, "tolerance"), ([[0, 0]], np.nan, "tolerance"), ([1, 2, 3], 1.0, "^q:")],
)
def test_impossible_input_is_refused(q, tolerance, reason):
    with pytest.raises(PointSetError, match=reason):
        greedy_pairs([[0, 0]], q, tolerance)

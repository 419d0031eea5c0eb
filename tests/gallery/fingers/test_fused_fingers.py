"""Scores of several fingers: Fisher's rule, and the choice of who is compared with whom."""

from itertools import combinations, permutations
from math import log, log10

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import chi2

from fpmatch.gallery.fingers.fused_fingers import assign_fingers, fuse_fingers
from fpmatch.matching.calibration import score_to_fmr

LN10 = log(10)
SCORES = st.floats(0, 100)


@given(st.lists(SCORES, min_size=1, max_size=6))
def test_the_fused_rate_is_that_of_the_chi_squared_distribution(scores):
    fused = min(100.0, fuse_fingers(scores))
    rates = np.array([score_to_fmr(one) for one in scores])
    expected = chi2.sf(-2 * np.log(rates).sum(), 2 * len(scores))
    assert fused == pytest.approx(min(100.0, -10 * log10(max(expected, 1e-300))), abs=1e-6)


@given(st.lists(SCORES, min_size=2, max_size=5), st.randoms(use_true_random=False))
def test_the_order_of_fingers_does_not_matter_to_the_last_bit(scores, random):
    other = random.sample(scores, len(scores))
    assert fuse_fingers(scores) == fuse_fingers(other)


def slow_assignment(scores, allowed):
    probes, fingers = scores.shape
    for size in range(min(probes, fingers), 0, -1):
        every = [
            list(zip(some, theirs, strict=True))
            for some in combinations(range(probes), size)
            for theirs in permutations(range(fingers), size)
        ]
        products = [
            2 * sum(scores[pair] for pair in pairs) * LN10 / 10
            for pairs in every
            if all(allowed[pair] for pair in pairs)
        ]
        found = [-10 * chi2.logsf(one, 2 * size) / LN10 for one in products]
        if found:
            return min(max(0.0, max(found) - 10 * log10(len(found))), 100.0)
    return 0.0


SHAPES = st.tuples(st.integers(1, 3), st.integers(1, 4))


@given(SHAPES.flatmap(lambda s: st.tuples(arrays(float, s, elements=SCORES), arrays(bool, s))))
def test_the_best_of_all_assignments_counts_and_their_number_costs(drawn):
    scores, allowed = drawn
    score, pairs = assign_fingers(scores, allowed)
    assert score == pytest.approx(slow_assignment(scores, allowed), abs=1e-6)
    assert all(allowed[pair] for pair in pairs)
    assert len({i for i, _ in pairs}) == len({f for _, f in pairs}) == len(pairs)


@pytest.mark.parametrize("fingers", [10, 300])
def test_ten_probes_are_assigned_at_once(fingers):
    scores = np.full((10, fingers), 1.0) + 49 * np.eye(10, fingers)
    score, pairs = assign_fingers(scores, np.ones(scores.shape, bool))
    assert (score, pairs) == (100.0, [(k, k) for k in range(10)])

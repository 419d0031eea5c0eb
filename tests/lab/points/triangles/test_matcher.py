import numpy as np
import pytest
from pointset_strategies import check_sound, worn

from fpmatch.lab.points.triangles.matcher import match_by_triangles
from fpmatch.pointset.geometry import _grid_kernel as kernel
from fpmatch.pointset.geometry.similarity import Similarity
from research.points.random_sets import independent_pair, random_pair

# Interpreted, a proposal costs some hundred times as much: the search is cut where it is in vain.
MOST = 20_000 if kernel.COMPILED else 200
TRIALS = 8 if kernel.COMPILED else 2

needs_compiled_kernels = pytest.mark.skipif(
    not kernel.COMPILED, reason="interpreted, large sets take minutes"
)


def recognised(case, match):
    """Tell whether at least 80 % of the true pairs were found."""
    true = set(map(tuple, case.pairs.tolist()))
    return len(true & set(map(tuple, match.pairs.tolist()))) >= 0.8 * len(true)


@pytest.mark.parametrize("times", [2, 4])
@pytest.mark.parametrize(
    ("m", "rho", "eta", "lambda_"),
    [(50, 0.95, 0.175, 0.428), (100, 0.95, 0.175, 0.428), (100, 0.6, 0.25, 0.61)],
)
def test_patches_are_recognised(m, rho, eta, lambda_, times):
    for seed in range(TRIALS):
        case = random_pair(m, times * m, rho, eta, lambda_, rng=seed)
        match = match_by_triangles(case.p, case.q, tolerance=case.tolerance)
        assert recognised(case, match)
        assert match.chance < 1e-3
        corners = np.array([[0, 0], [1, 0], [0, 1]]) * np.ptp(case.p) + case.p.min(axis=0)
        apart = match.transform.apply(corners) - case.transform.apply(corners)
        assert np.hypot(*apart.T).max() < 3 * case.tolerance


def match_half(n, seed, move, jitter):
    """Match a uniform set and a moved copy of which half the points are replaced; check it."""
    p = np.random.default_rng(seed).uniform(0, 1, (n, 2))
    q, place = worn(p, Similarity(), seed, jitter, share=0.5)
    q = move.apply(q)
    match = match_by_triangles(p, q)
    check_sound(match, p, q)
    assert match.transform is not None, match.reason
    assert sum(place[i] == j for i, j in match.pairs.tolist()) > 0.4 * n


@pytest.mark.slow
@needs_compiled_kernels
def test_half_of_a_hundred_thousand_points_are_enough():
    match_half(100_000, 1, Similarity(1.7, 0.7, 3.0, -2.0), 0.02)


def test_a_search_says_whether_it_ended_at_its_limit():
    case = independent_pair(50, 100, 0.61, rng=0)
    limited = match_by_triangles(case.p, case.q, tolerance=case.tolerance, max_proposals=100)
    assert limited.reason.endswith("; the search ended at its limit, after 100 proposals")
    whole = match_by_triangles(case.p[:6], case.q[:6], tolerance=1e-3)
    assert whole.transform is None
    assert whole.reason == "no transform that was tried pairs more points than expected by chance"

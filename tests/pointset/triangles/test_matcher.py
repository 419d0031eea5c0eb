from __future__ import annotations

import numpy as np
import pytest

from fpmatch.pointset.random_sets import independent_pair, random_pair
from fpmatch.pointset.triangles import _proposal_kernel as kernel
from fpmatch.pointset.triangles.matcher import TriangleParameters, match_by_triangles

# Interpreted, a proposal costs some hundred times as much: the search is cut where it is in vain.
BOUNDED = TriangleParameters(max_proposals=20_000 if kernel.COMPILED else 200)
TRIALS = 8 if kernel.COMPILED else 2


def recognised(case, match) -> bool:
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


@pytest.mark.parametrize("seed", range(TRIALS))
def test_independent_sets_do_not_match(seed):
    case = independent_pair(50, 100, 0.61, rng=seed)
    match = match_by_triangles(case.p, case.q, tolerance=case.tolerance, parameters=BOUNDED)
    assert match.transform is None
    assert len(match.pairs) == 0


def test_an_outlier_far_off_changes_nothing():
    points = np.random.default_rng(3).uniform(0, 100, (30, 2))
    with_outlier = np.vstack([points, [[1300.0, 1300.0]]])
    match = match_by_triangles(points, with_outlier)
    assert match.pairs.tolist() == [[i, i] for i in range(30)]


@pytest.mark.parametrize("seed", range(TRIALS))
def test_clusters_of_different_sets_do_not_match(seed):
    rng = np.random.default_rng(seed)
    p, q = (
        np.vstack([rng.normal(rng.uniform(0, 200, 2), 1, (15, 2)) for _ in range(3)])
        for _ in range(2)
    )
    assert match_by_triangles(p, q, parameters=BOUNDED).transform is None

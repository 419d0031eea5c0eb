from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.errors import PointSetError
from fpmatch.pointset.random_sets import independent_pair, random_pair
from fpmatch.pointset.similarity import Similarity
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


@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.1, 10),
    st.floats(-math.pi, math.pi),
    st.floats(-1000, 1000),
)
@settings(max_examples=20 if kernel.COMPILED else 3)
def test_exact_copies_are_recovered_exactly(seed, scale, rotation, shift):
    points = np.random.default_rng(seed).uniform(0, 100, (30, 2))
    truth = Similarity(scale, rotation, shift, -shift)
    match = match_by_triangles(points, truth.apply(points))
    assert match.matched_share == 1.0
    assert (match.pairs[:, 0] == match.pairs[:, 1]).all()
    assert match.transform.scale == pytest.approx(scale, rel=1e-6)
    assert math.remainder(match.transform.rotation - rotation, 2 * math.pi) == pytest.approx(
        0, abs=1e-6
    )


@given(
    arrays(np.float64, st.tuples(st.integers(0, 12), st.just(2)), elements=st.integers(0, 6)),
    arrays(np.float64, st.tuples(st.integers(0, 12), st.just(2)), elements=st.integers(0, 6)),
)
def test_lattices_with_coincident_points_give_a_sound_answer(p, q):
    try:
        match = match_by_triangles(p, q, parameters=BOUNDED)
    except PointSetError:
        return  # too few points, or all on one line
    assert len(np.unique(match.pairs[:, 0])) == len(match.pairs)
    assert len(np.unique(match.pairs[:, 1])) == len(match.pairs)
    if match.transform:
        assert 0 < match.matched_share <= 1
        assert match.chance < 1e-3


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_points_are_refused(count):
    points = np.random.default_rng(1).uniform(0, 1, (count, 2))
    with pytest.raises(PointSetError, match=rf"^q: fewer than three points: {count}$"):
        match_by_triangles(np.eye(3)[:, :2], points)


def test_three_points_match_nothing_by_more_than_chance():
    points = np.random.default_rng(1).uniform(0, 1, (3, 2))
    assert match_by_triangles(points, points).transform is None


def test_points_on_a_line_are_refused():
    line = np.column_stack([np.arange(20.0), np.zeros(20)])
    with pytest.raises(PointSetError, match=r"^p: all points lie on one line$"):
        match_by_triangles(line, np.random.default_rng(1).uniform(0, 1, (9, 2)))


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.inf, math.nan])
def test_tolerance_must_be_positive(tolerance):
    with pytest.raises(PointSetError, match="tolerance must be positive"):
        match_by_triangles(np.eye(3)[:, :2], np.eye(3)[:, :2], tolerance=tolerance)


def test_a_set_that_is_no_set_is_named():
    with pytest.raises(PointSetError, match=r"^q:"):
        match_by_triangles(np.eye(3)[:, :2], np.zeros((5, 3)))


def test_coincident_points_are_paired_with_coincident_points():
    rng = np.random.default_rng(2)
    places = rng.uniform(0, 100, (30, 2))
    p = np.repeat(places, rng.integers(1, 4, 30), axis=0)
    order = rng.permutation(len(p))
    match = match_by_triangles(p, Similarity(2.0, 1.0, 3.0, 4.0).apply(p)[order])
    assert match.matched_share == 1.0
    assert len(np.unique(match.pairs[:, 1])) == len(p)
    assert match.rms < 1e-9


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


def test_a_small_part_of_a_large_set_is_found_from_either_side():
    large = np.random.default_rng(4).uniform(0, 100, (400, 2))
    part = Similarity(0.5, -1.0, 7.0, 8.0).apply(large[np.hypot(*(large - 50).T) < 15])
    forth, back = match_by_triangles(part, large), match_by_triangles(large, part)
    assert forth.matched_share == back.matched_share == 1.0
    assert forth.pairs[forth.pairs[:, 1].argsort()].tolist() == back.pairs[:, ::-1].tolist()
    assert back.transform.scale == pytest.approx(0.5)


def test_the_same_sets_give_the_same_match():
    case = random_pair(50, 100, 0.6, 0.25, 0.61, rng=5)
    first, second = (match_by_triangles(case.p, case.q) for _ in range(2))
    assert first.transform == second.transform
    assert first.pairs.tolist() == second.pairs.tolist()

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import (
    check_sound,
    crowded_pixels,
    seeds,
)

from fpmatch.errors import PointSetError
from fpmatch.lab.points.van_wamelen.matcher import (
    SearchPlan,
    match_van_wamelen,
    nearest_neighbours,
    plan_search,
    sort_set,
)
from fpmatch.pointset.geometry._grid_kernel import COMPILED
from fpmatch.pointset.geometry.frames import UnitFrame
from research.points.random_sets import independent_pair, random_pair

TRIALS = 10 if COMPILED else 2
LITTLE_WORK = 200_000 if COMPILED else 20_000

SETTINGS = [(0.95, 0.175, 0.428), (0.6, 0.25, 0.61), (0.9, 0.4, 0.84)]


@pytest.mark.parametrize(("rho", "eta", "lambda_"), SETTINGS)
def test_recognises_the_papers_patches(rho, eta, lambda_):
    recognised = 0
    for seed in range(TRIALS):
        pair = random_pair(50, 100, rho, eta, lambda_, rng=seed)
        match = match_van_wamelen(pair.p, pair.q, rho=rho, lambda_=lambda_, seed=seed)
        check_sound(match, pair.p, pair.q)
        true_pairs = {*map(tuple, pair.pairs.tolist())} & {*map(tuple, match.pairs.tolist())}
        recognised += (
            match.matched_share >= rho
            and len(true_pairs) >= 0.8 * len(pair.pairs)
            and match.transform.apply(pair.p)
            == pytest.approx(pair.transform.apply(pair.p), abs=pair.tolerance)
        )
    assert recognised >= 0.9 * TRIALS


def test_independent_sets_do_not_match():
    for seed in range(TRIALS):
        pair = independent_pair(30, 60, 0.428, rng=seed)
        match = match_van_wamelen(pair.p, pair.q, rho=0.95, lambda_=0.428)
        check_sound(match, pair.p, pair.q)
        assert match.transform is None


@pytest.mark.parametrize(
    ("arguments", "plan"),
    [
        # by hand: ln 50 / 2(0.95 - 0.0458)² = 2.39; 2·0.428·√(3/π) = 0.84; ln .05 / ln .05 = 1
        ((50, 100, 0.95, 0.428), SearchPlan(3, 1, 1, 3, 48)),
        # ln 400 / 2(0.6 - 0.0930)² = 11.66; 2·0.61·√(12/π) = 2.38; ln .05 / ln .4 = 3.27
        ((400, 800, 0.6, 0.61), SearchPlan(12, 3, 4, 8, 240)),
        # ln 200 / 2(0.9 - 0.1764)² = 5.06; 2·0.84·√(6/π) = 2.32; ln .05 / ln .1 = 1.30
        ((200, 400, 0.9, 0.84), SearchPlan(6, 3, 2, 6, 180)),
        # the window takes all the neighbours there are, and no base neighbour is left over
        ((3, 3, 0.9, 0.84), SearchPlan(2, 1, 2, 2, 3)),
        ((3, 9, 1.0, 0.0), SearchPlan(1, 1, 1, 1, 3)),
    ],
)
def test_the_plan_follows_the_formulas(arguments, plan):
    assert plan_search(*arguments) == plan


def square_lattice(side):
    return np.argwhere(np.ones((side, side))).astype(float)


def line(size):
    return np.random.default_rng(2).uniform(0, 9, (size, 1)) * (1.0, 2.0)


def crowd_with_an_outlier(size):
    return np.vstack([np.random.default_rng(3).uniform(0, 1e-6, (size, 2)), [[1.0, 1.0]]])


@pytest.mark.parametrize(
    ("p", "q"),
    [
        (square_lattice(8), square_lattice(12)),
        (line(60), line(120)),
        (square_lattice(8), line(120)),
        (np.zeros((50, 2)), square_lattice(12)),
        (square_lattice(8), np.ones((90, 2))),
        (crowd_with_an_outlier(60), crowd_with_an_outlier(200)),
        (square_lattice(8), crowd_with_an_outlier(200)),
    ],
)
@pytest.mark.parametrize(("rho", "lambda_"), [(0.95, 0.428), (0.6, 0.61), (0.2, 0.89)])
def test_hostile_sets_match_soundly_or_not_at_all(p, q, rho, lambda_):
    check_sound(match_van_wamelen(p, q, rho=rho, lambda_=lambda_, max_steps=LITTLE_WORK), p, q)


def test_work_is_bounded_whatever_the_sets():
    side, crowd = (100, 20_000) if COMPILED else (30, 2000)
    p, q = square_lattice(side), crowd_with_an_outlier(crowd)
    for pattern, target in ((p, q), (q[::2], np.vstack([p, p]))):
        match = match_van_wamelen(pattern, target, rho=0.95, lambda_=0.428, max_steps=LITTLE_WORK)
        assert match.transform is None
        assert match.local_matches < LITTLE_WORK


@pytest.mark.parametrize(
    ("name", "value"),
    [("rho", 0.0), ("rho", math.nan), ("lambda_", -0.1), ("lambda_", 2.0), ("tolerance", -1.0)],
)
def test_refuses_parameters_outside_their_range(name, value):
    points = square_lattice(4)
    with pytest.raises(PointSetError, match=name.rstrip("_")):
        match_van_wamelen(points, points, **{"rho": 0.9, "lambda_": 0.4, name: value})


clouds = st.one_of(
    crowded_pixels.filter(len),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (40, 2))),
    seeds.map(lambda seed: np.random.default_rng(seed).standard_cauchy((40, 2))),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (40, 1)) * (1.0, 2.0)),
)
"""Crowded pixels, even points, a cluster with outliers, and a line."""


@given(clouds.filter(lambda cloud: len(cloud) > 1), st.integers(1, 12))
def test_the_neighbours_are_the_nearest_others(cloud, k):
    k = min(k, len(cloud) - 1)
    near = nearest_neighbours(cloud, k)
    assert (near.shape, near.dtype) == ((len(cloud), k), np.int32)
    for i in range(len(cloud)):
        squared = ((cloud - cloud[i]) ** 2).sum(axis=1)
        others = np.sort(np.delete(squared, i))[:k]
        assert squared[near[i]] == pytest.approx(others)
        assert i not in near[i]
        assert len({*near[i].tolist()}) == k


@given(clouds)
def test_the_spacing_is_by_the_area_of_the_hull(cloud):
    from scipy.spatial import ConvexHull, QhullError

    unit = UnitFrame.of(cloud).apply(cloud)
    _, spacing = sort_set(unit)
    try:
        area = ConvexHull(unit).volume
    except QhullError:  # a line, or fewer than three points
        area = 0.0
    assert spacing == pytest.approx(0.5 * math.sqrt(area / len(cloud)), abs=1e-5)

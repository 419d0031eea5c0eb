import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import (
    as_move,
    check_sound,
    crowded_pixels,
    moved,
    places,
    seeds,
    squared_distances,
)

from fpmatch.errors import PointSetError
from fpmatch.lab.points.van_wamelen import _search_kernel, matcher
from fpmatch.lab.points.van_wamelen import _search_kernel as kernel
from fpmatch.lab.points.van_wamelen.matcher import (
    SearchPlan,
    match_van_wamelen,
    nearest_neighbours,
    plan_search,
    sort_set,
)
from fpmatch.pointset.geometry.frames import UnitFrame
from fpmatch.pointset.geometry.similarity import Similarity
from research.points.random_sets import independent_pair, random_pair

COMPILED = _search_kernel.COMPILED
TRIALS = 10 if COMPILED else 2
LITTLE_WORK = 200_000 if COMPILED else 20_000

SETTINGS = [(0.95, 0.175, 0.428), (0.6, 0.25, 0.61), (0.9, 0.4, 0.84)]


def largest_difference(match, pair):
    """Return the largest distance of P's images under the transform found and the true one."""
    return float(np.hypot(*(match.transform.apply(pair.p) - pair.transform.apply(pair.p)).T).max())


@given(seeds, st.integers(20, 50))
def test_recovers_the_transform_of_patches_without_noise(seed, m):
    pair = random_pair(m, 2 * m, 1.0, 0.0, 0.2, rng=seed)
    match = match_van_wamelen(pair.p, pair.q, rho=1.0, lambda_=0.2, seed=seed)
    check_sound(match, pair.p, pair.q)
    assert match.matched_share == 1
    assert match.pairs.tolist() == pair.pairs.tolist()
    assert largest_difference(match, pair) < 1e-6


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
            and largest_difference(match, pair) <= pair.tolerance
        )
    assert recognised >= 0.9 * TRIALS


def test_independent_sets_do_not_match():
    for seed in range(TRIALS):
        pair = independent_pair(30, 60, 0.428, rng=seed)
        match = match_van_wamelen(pair.p, pair.q, rho=0.95, lambda_=0.428)
        check_sound(match, pair.p, pair.q)
        assert match.transform is None


def test_a_known_tolerance_replaces_the_density():
    pair = random_pair(30, 60, 1.0, 0.2, 0.428, rng=2)
    given_ = {"rho": 1.0, "lambda_": 0.428}
    match = match_van_wamelen(pair.p, pair.q, tolerance=pair.tolerance, **given_)
    assert match.pairs.tolist() == pair.pairs.tolist()
    assert match_van_wamelen(pair.p, pair.q, tolerance=1e-3, **given_).transform is None


def test_the_seed_decides_and_nothing_else():
    pair = random_pair(40, 80, 0.6, 0.25, 0.61, rng=5)
    matches = [
        match_van_wamelen(pair.p, pair.q, rho=0.6, lambda_=0.61, seed=seed) for seed in (1, 1, 2, 3)
    ]
    first, again, *others = ((m.transform, m.pairs.tolist(), m.local_matches) for m in matches)
    assert first == again
    assert any(other[2] != first[2] for other in others)


@pytest.mark.parametrize(
    ("arguments", "plan"),
    [
        # by hand: ln 50 / 2(0.95 - 0.0458)² = 2.39; 2·0.428·√(3/π) = 0.84; ln .05 / ln .05 = 1
        ((50, 100, 0.95, 0.428), SearchPlan(3, 1, 1, 50, 3, 48)),
        # ln 400 / 2(0.6 - 0.0930)² = 11.66; 2·0.61·√(12/π) = 2.38; ln .05 / ln .4 = 3.27
        ((400, 800, 0.6, 0.61), SearchPlan(12, 3, 4, 400, 8, 240)),
        # ln 200 / 2(0.9 - 0.1764)² = 5.06; 2·0.84·√(6/π) = 2.32; ln .05 / ln .1 = 1.30
        ((200, 400, 0.9, 0.84), SearchPlan(6, 3, 2, 200, 6, 180)),
        # the window takes all the neighbours there are, and no base neighbour is left over
        ((3, 3, 0.9, 0.84), SearchPlan(2, 1, 2, 3, 2, 3)),
        ((3, 9, 1.0, 0.0), SearchPlan(1, 1, 1, 3, 1, 3)),
    ],
)
def test_the_plan_follows_the_formulas(arguments, plan):
    assert plan_search(*arguments) == plan
    # the more confidence, the more pivots
    pivots = [plan_search(200, 400, 0.6, 0.61, c).pivots for c in (0.1, 0.5, 0.9, 0.999, 1.0)]
    assert pivots == [1, 1, 3, 8, 200]


sizes, shares = st.integers(3, 10**6), st.floats(0.01, 1)


@given(sizes, sizes, shares, st.floats(0, 0.999), shares)
def test_every_rank_of_a_plan_is_in_the_lists(m, n, rho, share, confidence):
    plan = plan_search(m, n, rho, 2 * math.sqrt(share * rho), confidence)
    half = plan.window // 2
    assert plan.window % 2 == 1
    assert 1 <= plan.neighbours < min(m, n)
    assert 1 <= plan.bases <= plan.neighbours - 2 * half
    assert 1 <= plan.pivots <= m
    assert 1 <= plan.enough_near <= plan.neighbours
    assert 1 <= plan.enough <= m


@pytest.mark.parametrize("size", [0, 1, 2, 10])
def test_too_few_points_match_nothing(size):
    many = np.random.default_rng(1).uniform(0, 9, (20, 2))
    few = many[:size]  # ten are too few for nine tenths of twenty
    for p, q in ((many, few), *([(few, many), (few, few)] if size < 3 else [])):
        match = match_van_wamelen(p, q, rho=0.9, lambda_=0.4)
        check_sound(match, p, q)
        assert match.transform is None


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
        (square_lattice(8), square_lattice(12) * 1.1 + line(144)),
        (line(60), line(120)),
        (square_lattice(8), line(120)),
        (line(120), square_lattice(12)),
        (np.zeros((50, 2)), square_lattice(12)),
        (square_lattice(8), np.ones((90, 2))),
        (np.repeat(square_lattice(4), 5, axis=0), np.repeat(square_lattice(5), 5, axis=0)),
        (crowd_with_an_outlier(60), crowd_with_an_outlier(200)),
        (square_lattice(8), crowd_with_an_outlier(200)),
        (crowd_with_an_outlier(60), square_lattice(12)),
    ],
)
@pytest.mark.parametrize(("rho", "lambda_"), [(0.95, 0.428), (0.6, 0.61), (0.2, 0.89)])
def test_hostile_sets_match_soundly_or_not_at_all(p, q, rho, lambda_):
    check_sound(match_van_wamelen(p, q, rho=rho, lambda_=lambda_, max_steps=LITTLE_WORK), p, q)


def test_a_lattice_matches_a_larger_one():
    match = match_van_wamelen(square_lattice(5), square_lattice(8), rho=1.0, lambda_=0.4)
    assert match.matched_share == 1
    assert match.rms == pytest.approx(0, abs=1e-9)


def test_work_is_bounded_whatever_the_sets():
    side, crowd = (100, 20_000) if COMPILED else (30, 2000)
    p, q = square_lattice(side), crowd_with_an_outlier(crowd)
    for pattern, target in ((p, q), (q[::2], np.vstack([p, p]))):
        match = match_van_wamelen(pattern, target, rho=0.95, lambda_=0.428, max_steps=LITTLE_WORK)
        assert match.transform is None
        assert match.local_matches < LITTLE_WORK


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("rho", [0.0, math.nan]),
        ("confidence", [1.5]),
        ("lambda_", [-0.1, 2.0]),
        ("tolerance", [math.inf, -1.0]),
    ],
)
def test_refuses_parameters_outside_their_range(name, values):
    points = square_lattice(4)
    for value in values:
        with pytest.raises(PointSetError, match=name.rstrip("_")):
            match_van_wamelen(points, points, **{"rho": 0.9, "lambda_": 0.4, name: value})


clouds = st.one_of(
    crowded_pixels.filter(len),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (40, 2))),
    seeds.map(lambda seed: np.random.default_rng(seed).standard_cauchy((40, 2))),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (40, 1)) * (1.0, 2.0)),
)
"""Crowded pixels, even points, a cluster with outliers, and a line."""

NO_BOUND = 10**12


def sorted_in_frame(points):
    return sort_set(points, UnitFrame.of(points)).grid


def no_steps():
    return np.zeros(1, np.int64)


def nearest_with_numpy(grid, x, y, reach, taken):
    """Return the nearest free point within reach, -1 for none, and its squared distance."""
    squared = np.where(taken > 0, np.inf, squared_distances(grid, x, y))
    nearest = int(squared.argmin())
    near = squared[nearest] <= reach * reach
    return (nearest, float(squared[nearest])) if near else (-1, math.inf)


@given(clouds, seeds)
def test_nearest_within_agrees_with_its_twin(cloud, seed):
    grid = sorted_in_frame(cloud)
    rng = np.random.default_rng(seed)
    taken = (rng.random(len(cloud)) < 0.3).astype(np.int32)
    asked = [*rng.uniform(-0.5, 1.5, (20, 2)), *places(grid).T[:5]]
    for x, y in asked:
        reach = float(rng.choice([0.0, 0.02, 0.125, 0.5, 3.0]))
        found = kernel.nearest_within(grid, x, y, reach, taken, no_steps())
        expected, squared = nearest_with_numpy(grid, x, y, reach, taken)
        assert (found < 0) == (expected < 0)
        if found >= 0:
            assert not taken[found]
            assert squared_distances(grid, x, y)[found] == squared


def test_nothing_is_near_a_point_out_of_this_world():
    grid = sorted_in_frame(np.random.default_rng(1).uniform(0, 1, (40, 2)))
    free = np.zeros(40, np.int32)
    for where in ((math.nan, 0.5), (0.5, math.nan), (math.inf, 0.5), (0.5, 1e300)):
        assert kernel.nearest_within(grid, *where, 0.3, free, no_steps()) == -1


@given(clouds.filter(lambda cloud: len(cloud) > 1), st.integers(1, 12))
def test_the_neighbours_are_the_nearest_others(cloud, k):
    grid = sorted_in_frame(cloud)
    k = min(k, len(cloud) - 1)
    near = nearest_neighbours(grid, k)
    assert (near.shape, near.dtype) == ((len(cloud), k), np.int32)
    for i in range(len(cloud)):
        squared = squared_distances(grid, *places(grid)[:, i])
        others = np.sort(np.delete(squared, i))[:k]
        assert squared[near[i]] == pytest.approx(others, abs=1e-15)
        assert i not in near[i]
        assert len({*near[i].tolist()}) == k


@given(clouds)
def test_the_spacing_is_by_the_area_of_the_hull(cloud):
    from scipy.spatial import ConvexHull, QhullError

    in_order = sort_set(cloud, UnitFrame.of(cloud))
    try:
        area = ConvexHull(in_order.unit).volume
    except QhullError:  # a line, or fewer than three points
        area = 0.0
    assert in_order.spacing == pytest.approx(0.5 * math.sqrt(area / len(cloud)), abs=1e-5)


@given(seeds)
def test_a_segment_is_mapped_to_another(seed):
    p, q = (
        sorted_in_frame(points) for points in np.random.default_rng(seed).uniform(0, 1, (2, 2, 2))
    )
    move = np.empty(4)
    assert kernel.map_segment(p, 0, 1, q, 1, 0, move)
    assert moved(places(p), move) == pytest.approx(places(q)[:, ::-1])
    same = sorted_in_frame(np.ones((2, 2)))
    assert not kernel.map_segment(same, 0, 1, q, 0, 1, move)
    assert not kernel.map_segment(q, 0, 1, same, 0, 1, move)


@given(seeds, st.sampled_from([0.0, 0.05, 0.2, 0.4]))
def test_the_local_test_agrees_with_its_twin(seed, reach):
    rng = np.random.default_rng(seed)
    p, q = (sorted_in_frame(rng.uniform(0, 1, (size, 2))) for size in (20, 30))
    near = rng.permutation(20)[:8].astype(np.int32)
    angle, size = rng.uniform(0, 7), rng.uniform(0.2, 1.5)
    move = np.array([size * math.cos(angle), size * math.sin(angle), *rng.uniform(-0.2, 0.8, 2)])
    free = np.zeros(30, np.int32)
    meetings = []
    for i in near:
        nearest, _ = nearest_with_numpy(q, *moved(places(p), move)[:, i], reach, free)
        if nearest >= 0:
            meetings.append((int(i), nearest))
    pair = np.empty((2, 21), np.int32)
    for enough in (1, len(meetings) + 1, len(meetings)):
        count = kernel.match_locally(p, near, q, move, reach, enough, pair, free, no_steps())
        assert count == (len(meetings) if len(meetings) >= enough else 0)
    assert pair.T[: len(meetings)].tolist() == [list(meeting) for meeting in meetings]


@given(seeds)
def test_pairing_agrees_with_its_twin(seed):
    rng = np.random.default_rng(seed)
    p, q = (sorted_in_frame(rng.uniform(0, 1, (size, 2))) for size in (20, 30))
    move = np.array([1.0, 0.1, *rng.uniform(-0.1, 0.1, 2)])
    taken = np.zeros(30, np.int32)
    pairs = []
    for i, (x, y) in enumerate(moved(places(p), move).T):
        nearest, _ = nearest_with_numpy(q, x, y, 0.15, taken)
        if nearest >= 0:
            taken[nearest] = 1
            pairs.append([i, nearest])
    taken[:] = 0
    pair = np.empty((2, 21), np.int32)
    for enough, expected in ((0, len(pairs)), (len(pairs), len(pairs)), (len(pairs) + 1, 0)):
        rest = (enough, NO_BOUND, pair, taken, no_steps())
        assert kernel.pair_within(p, q, move, 0.15, *rest) == expected
        assert pair.T[:expected].tolist() == pairs[:expected]
        assert not taken.any()


@given(seeds)
def test_least_squares_agree_with_the_similarity_fit(seed):
    rng = np.random.default_rng(seed)
    p, q = (sorted_in_frame(points) for points in rng.uniform(0, 1, (2, 12, 2)))
    same = sorted_in_frame(np.ones((12, 2)))
    pair = np.array([rng.permutation(12), rng.permutation(12)], np.int32)
    move = np.empty(4)
    assert kernel.fit_pairs(p, q, pair, 7, move)
    fit = Similarity.fit(places(p).T[pair[0, :7]], places(q).T[pair[1, :7]])
    assert move == pytest.approx(as_move(fit), abs=1e-9)
    assert not kernel.fit_pairs(same, q, pair, 7, move)
    assert not kernel.fit_pairs(p, same, pair, 7, move)


def test_the_global_match_grows_from_a_corner_to_the_whole():
    pair = random_pair(60, 120, 0.9, 0.1, 0.5, rng=4)
    _, p, order_p, _ = sort_set(pair.p, UnitFrame.of(pair.p))
    _, q, order_q, spacing = sort_set(pair.q, UnitFrame.of(pair.q))
    in_order = order_p.argsort()[pair.pairs[:, 0]], order_q.argsort()[pair.pairs[:, 1]]
    true_pairs = np.array(in_order, np.int32)
    room = np.empty((2, 2, 61), np.int32)
    corner = true_pairs[:, true_pairs[0].argsort()[:8]]
    tolerance, free, move = 0.5 * spacing, np.zeros(120, np.int32), np.empty(4)
    for enough, expected in ((54, True), (61, False)):
        room[0, :, :8] = corner
        arguments = (p, q, tolerance, 8, enough, NO_BOUND, move, room, free)
        count = kernel.match_globally(*arguments, no_steps())
        assert (count >= 54) == expected
        assert not free.any()
        if count:
            of_p, of_q = room[0, :, :count]
            residual = moved(places(p), move)[:, of_p] - places(q)[:, of_q]
            assert np.hypot(*residual).max() <= tolerance
            assert len(set(of_p.tolist())) == len(set(of_q.tolist())) == count
            found = {*zip(of_p.tolist(), of_q.tolist(), strict=True)}
            assert len(found & {*zip(*true_pairs.tolist(), strict=True)}) >= 0.8 * 54


def test_work_is_counted_and_bounded(monkeypatch):
    pair = random_pair(30, 60, 0.2, 0.1, 0.5, rng=4)
    steps = []

    def counted(*arguments):
        kernel.search(*arguments)
        steps.append(int(arguments[-2][0]))

    monkeypatch.setattr(matcher, "kernel", SimpleNamespace(search=counted))
    for most in (0, 20_000):
        match_van_wamelen(pair.p, pair.q, rho=0.9, lambda_=0.5, max_steps=most)
    assert steps[0] == 0
    assert 20_000 <= steps[1] < 40_000

"""The kernel against slow, obvious numpy twins, and compiled against interpreted."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, seeds

import fpmatch.pointset
from fpmatch.pointset.points import UnitFrame
from fpmatch.pointset.random_sets import random_pair
from fpmatch.pointset.van_wamelen import _search_kernel as kernel
from fpmatch.pointset.van_wamelen import matcher
from fpmatch.pointset.van_wamelen.matcher import _CellGrid, _sort_into_cells, match_van_wamelen

clouds = st.one_of(
    crowded_pixels.filter(len),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (40, 2))),
    seeds.map(lambda seed: np.random.default_rng(seed).standard_cauchy((40, 2))),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (40, 1)) * (1.0, 2.0)),
)
"""Crowded pixels, even points, a crowd with outliers, and a line."""


@pytest.fixture(scope="module")
def interpreted() -> ModuleType:
    """Return the kernel as ordinary Python, whether or not it is compiled as well."""
    source = Path(fpmatch.pointset.__file__).parent / "van_wamelen" / "_search_kernel.py"
    spec = importlib.util.spec_from_file_location("interpreted_search_kernel", source)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert not module.COMPILED
    return module


NO_BOUND = 10**12


def grid_of(points: np.ndarray) -> _CellGrid:
    return _sort_into_cells(points, UnitFrame.of(points))


def cells(grid: _CellGrid) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    return grid.point, grid.start, grid.shape, grid.per_unit


def no_looks() -> np.ndarray:
    return np.zeros(1, np.int64)


def distances_from(grid: _CellGrid, x: float, y: float) -> np.ndarray:
    return (grid.point[0] - x) ** 2 + (grid.point[1] - y) ** 2


def nearest_with_numpy(
    grid: _CellGrid, x: float, y: float, reach: float, taken: np.ndarray
) -> tuple[int, float]:
    """Return the nearest free point within reach, -1 for none, and its squared distance."""
    squared = np.where(taken > 0, np.inf, distances_from(grid, x, y))
    nearest = int(squared.argmin())
    near = squared[nearest] <= reach * reach
    return (nearest, float(squared[nearest])) if near else (-1, math.inf)


def images(grid: _CellGrid, move: np.ndarray) -> np.ndarray:
    a, b, tx, ty = move
    return np.array([[a, -b], [b, a]]) @ grid.point + [[tx], [ty]]


@given(clouds)
def test_the_grid_holds_every_point_in_its_cell(cloud: np.ndarray) -> None:
    grid = grid_of(cloud)
    rows, columns = grid.shape
    assert sorted(grid.order.tolist()) == list(range(len(cloud)))
    assert grid.frame.apply(cloud)[grid.order].T.tolist() == grid.point.tolist()
    assert rows * columns <= 16 * len(cloud) + 16
    cell = np.repeat(np.arange(rows * columns), np.diff(grid.start))
    column, row = (grid.point * grid.per_unit).astype(int)
    assert cell.tolist() == (row * columns + column).tolist()


@given(clouds, seeds)
def test_nearest_within_agrees_with_its_twin(cloud: np.ndarray, seed: int) -> None:
    grid = grid_of(cloud)
    rng = np.random.default_rng(seed)
    taken = (rng.random(len(cloud)) < 0.3).astype(np.int32)
    asked = [*rng.uniform(-0.5, 1.5, (20, 2)), *grid.point.T[:5]]
    for x, y in asked:
        reach = float(rng.choice([0.0, 0.02, 0.125, 0.5, 3.0]))
        found = kernel.nearest_within(*cells(grid), x, y, reach, taken, no_looks())
        expected, squared = nearest_with_numpy(grid, x, y, reach, taken)
        assert (found < 0) == (expected < 0)
        if found >= 0:
            assert not taken[found]
            assert distances_from(grid, x, y)[found] == squared


@pytest.mark.parametrize("where", [(math.nan, 0.5), (0.5, math.nan), (math.inf, 0.5), (0.5, 1e300)])
def test_nothing_is_near_a_point_out_of_this_world(where: tuple[float, float]) -> None:
    grid = grid_of(np.random.default_rng(1).uniform(0, 1, (40, 2)))
    free = np.zeros(40, np.int32)
    assert kernel.nearest_within(*cells(grid), *where, 0.3, free, no_looks()) == -1


@given(clouds.filter(lambda cloud: len(cloud) > 1), st.integers(1, 12))
def test_neighbour_lists_agree_with_their_twin(cloud: np.ndarray, k: int) -> None:
    grid = grid_of(cloud)
    k = min(k, len(cloud) - 1)
    for i in range(len(cloud)):
        near, squared = np.empty(k, np.int32), np.empty(k)
        kernel.find_neighbours(*cells(grid), i, near, squared, no_looks())
        expected = distances_from(grid, *grid.point[:, i])
        others = np.delete(np.arange(len(cloud)), i)
        by_distance = others[np.argsort(expected[others], kind="stable")][:k]
        assert near.tolist() == by_distance.tolist()
        assert squared.tolist() == expected[by_distance].tolist()


@given(clouds)
def test_hull_area_agrees_with_its_twin(cloud: np.ndarray) -> None:
    from scipy.spatial import ConvexHull, QhullError

    unit = grid_of(cloud).point.T
    by_x = np.ascontiguousarray(unit[np.lexsort((unit[:, 1], unit[:, 0]))].T)
    area = kernel.hull_area(by_x, np.empty(len(unit) + 1, np.int32))
    try:
        expected = ConvexHull(unit).volume
    except QhullError:  # a line, or fewer than three points
        expected = 0.0
    assert area == pytest.approx(expected, abs=1e-9)


@given(seeds)
def test_a_pair_of_points_is_laid_on_another(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 2, 2))
    move = np.empty(4)
    assert kernel.lay(p, 0, 1, q, 1, 0, move)
    a, b, tx, ty = move
    assert np.array([[a, -b], [b, a]]) @ p + [[tx], [ty]] == pytest.approx(q[:, ::-1])
    same = np.ascontiguousarray(p[:, [0, 0]])
    assert not kernel.lay(same, 0, 1, q, 0, 1, move)
    assert not kernel.lay(q, 0, 1, same, 0, 1, move)


@given(seeds, st.sampled_from([0.0, 0.05, 0.2, 0.4]))
def test_the_local_test_agrees_with_its_twin(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    p, q = (grid_of(rng.uniform(0, 1, (size, 2))) for size in (20, 30))
    near = rng.permutation(20)[:8].astype(np.int32)
    angle, size = rng.uniform(0, 7), rng.uniform(0.2, 1.5)
    move = np.array([size * math.cos(angle), size * math.sin(angle), *rng.uniform(-0.2, 0.8, 2)])
    free = np.zeros(30, np.int32)
    meetings = []
    for i in near:
        nearest, _ = nearest_with_numpy(q, *images(p, move)[:, i], reach, free)
        if nearest >= 0:
            meetings.append((int(i), nearest))
    pair = np.empty((2, 21), np.int32)
    arguments = (p.point, near, *cells(q), move, reach)
    for enough in (1, len(meetings), len(meetings) + 1):
        count = kernel.match_locally(*arguments, enough, pair, free, no_looks())
        assert count == (len(meetings) if len(meetings) >= enough else 0)
    kernel.match_locally(*arguments, 0, pair, free, no_looks())
    assert pair.T[: len(meetings)].tolist() == [list(meeting) for meeting in meetings]


@given(seeds)
def test_pairing_agrees_with_its_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = (grid_of(rng.uniform(0, 1, (size, 2))) for size in (20, 30))
    move = np.array([1.0, 0.1, *rng.uniform(-0.1, 0.1, 2)])
    taken = np.zeros(30, np.int32)
    pairs = []
    for i, (x, y) in enumerate(images(p, move).T):
        nearest, _ = nearest_with_numpy(q, x, y, 0.15, taken)
        if nearest >= 0:
            taken[nearest] = 1
            pairs.append([i, nearest])
    taken[:] = 0
    pair = np.empty((2, 21), np.int32)
    arguments = (p.point, *cells(q), move, 0.15)
    count = kernel.pair_within(*arguments, 0, NO_BOUND, pair, taken, no_looks())
    assert pair.T[:count].tolist() == pairs
    assert kernel.pair_within(*arguments, count, NO_BOUND, pair, taken, no_looks()) == count
    assert kernel.pair_within(*arguments, count + 1, NO_BOUND, pair, taken, no_looks()) == 0
    assert not taken.any()


@given(seeds)
def test_least_squares_agree_with_the_similarity_fit(seed: int) -> None:
    from fpmatch.pointset.similarity import Similarity

    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 2, 12))
    pair = np.array([rng.permutation(12), rng.permutation(12)], np.int32)
    move = np.empty(4)
    assert kernel.fit_pairs(p, q, pair, 7, move)
    fit = Similarity.fit(p.T[pair[0, :7]], q.T[pair[1, :7]])
    assert move == pytest.approx([*fit.matrix[:, 0], fit.tx, fit.ty], abs=1e-9)
    assert not kernel.fit_pairs(np.ones((2, 12)), q, pair, 7, move)
    assert not kernel.fit_pairs(p, np.ones((2, 12)), pair, 7, move)


def test_the_global_match_grows_from_a_corner_to_the_whole() -> None:
    pair = random_pair(60, 120, 0.9, 0.1, 0.5, rng=4)
    p, q = grid_of(pair.p), grid_of(pair.q)
    place_p, place_q = p.order.argsort(), q.order.argsort()
    true_pairs = np.array([place_p[pair.pairs[:, 0]], place_q[pair.pairs[:, 1]]], np.int32)
    room = np.empty((2, 2, 61), np.int32)
    corner = true_pairs[:, true_pairs[0].argsort()[:8]]
    tolerance, free, move = 0.5 * q.spacing, np.zeros(120, np.int32), np.empty(4)
    for enough, expected in ((54, True), (61, False)):
        room[0, :, :8] = corner
        arguments = (p.point, *cells(q), tolerance, 8, enough, NO_BOUND, move, room, free)
        count = kernel.match_globally(*arguments, no_looks())
        assert (count >= 54) == expected
        assert not free.any()
        if count:
            of_p, of_q = room[0, :, :count]
            residual = images(p, move)[:, of_p] - q.point[:, of_q]
            assert np.hypot(*residual).max() <= tolerance
            assert len(set(of_p.tolist())) == len(set(of_q.tolist())) == count
            found = {*zip(of_p.tolist(), of_q.tolist(), strict=True)}
            assert len(found & {*zip(*true_pairs.tolist(), strict=True)}) >= 0.8 * 54


def test_work_is_counted_and_bounded() -> None:
    pair = random_pair(30, 60, 0.2, 0.1, 0.5, rng=4)
    seen = []

    def search_and_tell(*arguments: object) -> None:
        real_search(*arguments)
        seen.append(int(arguments[-2][0]))  # type: ignore[index]

    real_search = kernel.search
    stand_in = ModuleType("stand_in")
    stand_in.search, stand_in.hull_area = search_and_tell, kernel.hull_area  # type: ignore[attr-defined]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matcher, "kernel", stand_in)
        for most in (0, 20_000):
            match_van_wamelen(pair.p, pair.q, rho=0.9, lambda_=0.5, most_looks=most)
    neighbours_of_one_pivot = 60 * 5
    assert 0 < seen[0] < neighbours_of_one_pivot
    assert 20_000 <= seen[1] < 40_000


@given(seeds, st.sampled_from([(0.9, 0.175, 0.428), (0.6, 0.25, 0.61), (0.85, 0.4, 0.84)]))
@settings(max_examples=6)
def test_compiled_and_interpreted_agree_to_the_last_bit(
    interpreted: ModuleType, seed: int, setting: tuple[float, float, float]
) -> None:
    rho, eta, lambda_ = setting
    pair = random_pair(16, 32, rho, eta, lambda_, rng=seed)
    results = []
    for either in (kernel, interpreted):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(matcher, "kernel", either)
            results.append(
                match_van_wamelen(pair.p, pair.q, rho=rho, lambda_=lambda_, most_looks=50_000)
            )
    match, same_match = results
    assert match.transform == same_match.transform
    assert match.pairs.tolist() == same_match.pairs.tolist()
    assert (match.rms, match.local_matches) == (same_match.rms, same_match.local_matches)

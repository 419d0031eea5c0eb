"""Sets of points, and cells against numpy's look at every point."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, grid_of, places, seeds, squared_distances

from fpmatch.pointset.geometry.points import MAX_CELLS_PER_POINT, sort_into_cells

clouds = st.one_of(
    crowded_pixels.map(lambda points: np.ascontiguousarray(points.T)),
    seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 5, (2, 30))),
    seeds.map(lambda seed: np.random.default_rng(seed).standard_cauchy((2, 30))),
    st.builds(np.full, st.tuples(st.just(2), st.integers(1, 9)), st.floats(-1e6, 1e6)),
)
"""Points (2, N): crowded pixels and none at all, even points, a crowd with outliers, one place."""

sides = st.sampled_from([0.01, 0.5, 1.0, 2.0, 1e9])  # pixels lie on the borders of some

REACHES = [0.0, 0.5, 1.0, math.sqrt(2.0), 3.0, 1e100, math.inf]


def places_to_ask(points, seed):
    """Return places at points, among them, on the borders of pixels and far outside."""
    rng = np.random.default_rng(seed)
    among = rng.uniform(-1, 6, (4, 2))
    far = [[-1e3, 2.0], [2.0, 1e3], [0.5, 1e150]]
    return np.vstack([points.T[:3], among, among.round(), far])


def ask_within(grid, place, reach2, most, at=0):
    """Return the points within reach and their squared distances; nothing else is written."""
    near, distance2 = np.full(at + most + 3, -7, np.int32), np.full(at + most + 3, -7.0)
    end = at + grid.within(*place, reach2, most, near, distance2, at)
    assert end <= at + most
    for array in (near, distance2):
        assert (array[:at] == -7).all()
        assert (array[end:] == -7).all()
    return near[at:end].tolist(), distance2[at:end].tolist()


@given(clouds, sides)
def test_every_point_is_once_in_its_cell_of_not_too_many(points, side):
    grid = grid_of(points, side)
    assert sorted(grid.order) == list(range(points.shape[1]))
    assert places(grid).tolist() == points[:, np.asarray(grid.order)].tolist()
    column = np.minimum((np.asarray(grid.x) - grid.x0) * grid.per_unit, grid.columns - 1)
    row = np.minimum((np.asarray(grid.y) - grid.y0) * grid.per_unit, grid.rows - 1)
    cell = row.astype(int) * grid.columns + column.astype(int)
    counts = np.bincount(cell, minlength=grid.rows * grid.columns)
    assert np.diff(grid.start).tolist() == counts.tolist()
    assert (cell[:-1] <= cell[1:]).all()
    assert grid.columns * grid.rows <= 3 * MAX_CELLS_PER_POINT * max(4, points.shape[1]) + 1
    assert 1 / grid.per_unit >= side * (1 - 1e-12)
    if points.size:
        assert (grid.x0, grid.y0) == tuple(points.min(axis=1))
        beyond = points.max(axis=1) - (grid.x1, grid.y1)
        assert (beyond <= 1e-12 * np.abs(points).max()).all()  # but for rounding
    for k in range(points.shape[1]):
        column, row, *past = grid.around(grid.x[k], grid.y[k], 0.0)
        assert row * grid.columns + column == cell[k]
        assert past == [column + 1, row + 1]


@given(clouds, sides, seeds, st.sampled_from(REACHES), st.integers(1, 6), st.booleans())
def test_nearest_and_within_agree_with_a_look_at_every_point(
    points, side, seed, reach, most, beyond
):
    """Also where points lie beyond the grid."""
    grid, reach2 = grid_of(points, side), reach * reach
    if beyond:
        grid = sort_into_cells(points, side, low=(1, 1), high=(4, 4))
    for place in places_to_ask(points, seed):
        squared = squared_distances(grid, *place)
        found = grid.nearest(*place, reach2)
        assert (found >= 0) == (squared < reach2).any()
        assert found < 0 or squared[found] == squared.min()
        near, distance2 = ask_within(grid, place, reach2, most, at=most % 3)
        assert distance2 == np.sort(squared[squared <= reach2])[:most].tolist()
        assert distance2 == squared[near].tolist()
        assert len(set(near)) == len(near)


def test_only_the_points_counted_are_sorted():
    points = np.array([[0.0, 9.0, 1.0, 2.0], [0.0, 9.0, 1.0, 2.0]])
    grid = sort_into_cells(points, 1.0, low=(0, 0), high=(9, 9), count=2)
    assert sorted(grid.order) == [0, 1]
    assert ask_within(grid, np.array([1.0, 1.0]), math.inf, 4)[1] == [2.0, 128.0]


@pytest.mark.parametrize("place", [(math.inf, 0.5), (0.5, -math.inf), (math.nan, 0.5)])
def test_nothing_is_near_a_place_out_of_this_world(place):
    grid = grid_of(np.random.default_rng(1).uniform(0, 1, (2, 20)), 0.2)
    assert grid.nearest(*place, 0.3) == -1
    if not np.isnan(place).any():
        assert ask_within(grid, np.array(place), 0.3, 5) == ([], [])

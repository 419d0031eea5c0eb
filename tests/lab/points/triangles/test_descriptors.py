import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, in_columns, seeds, similarities

from fpmatch.lab.points.triangles.descriptors import (
    density_of,
    density_over_hull,
    describe,
    is_even,
    nearest_two,
    ring_triangles,
    sort_by_shape,
)
from fpmatch.pointset.delaunay.triangulate import triangulate
from research.arrangements import INDEPENDENT

clouds = crowded_pixels | seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (20, 2)))


def random_triangles(seed, n=12):
    """Return points (2, N) and the triangles of their mesh."""
    mesh = triangulate(np.random.default_rng(seed).uniform(0, 1, (n, 2)))
    return in_columns(mesh.points), mesh.triangles


@given(seeds, st.sampled_from([0.5, 0.8, 1.0]), st.sampled_from([0.0, 0.2, 0.5, 9.0]))
def test_descriptors_agree_with_complex_numbers(seed, near_tie, shortest):
    points, triangles = random_triangles(seed)
    found = describe(points, triangles, near_tie=near_tie, shortest=shortest)
    place = points[0] + 1j * points[1]
    expected = []
    for corners in triangles.tolist():
        turns = [corners[r:] + corners[:r] for r in range(3)]
        sides = [abs(place[b] - place[a]) for a, b, _ in turns]
        for (a, b, c), side in zip(turns, sides, strict=True):
            z = complex((place[c] - place[a]) / (place[b] - place[a]))
            if side >= near_tie * max(sides) and side >= shortest and z.imag > 0:
                expected.append(([a, b, c], (z.real, z.imag), float(side)))
    n = found.number
    corners, shapes, sides = zip(*expected, strict=True) if expected else ((), (), ())
    assert found.corner[:n].tolist() == list(corners)
    assert pytest.approx(np.reshape(shapes, (-1, 2)), abs=1e-9) == found.shape[:, :n].T
    assert found.side[:n] == pytest.approx(np.array(sides))
    assert found.negative_information.size == 0


@given(seeds, similarities(1e3, 1e3))
def test_shapes_stay_when_points_are_turned_scaled_and_shifted(seed, move):
    points, triangles = random_triangles(seed)
    there = in_columns(move.apply(points.T))
    one, other = (describe(each, triangles) for each in (points, there))
    assert one.number == other.number == len(triangles)
    assert (one.corner[: one.number] == other.corner[: one.number]).all()
    # a shift of 1000 leaves points of extent 0.001 ten digits; a flat triangle needs a few
    blur = 1e-9 + 1e-12 * 1e3 / move.scale
    assert other.shape[:, : one.number] == pytest.approx(one.shape[:, : one.number], abs=blur)
    assert other.side[: one.number] == pytest.approx(move.scale * one.side[: one.number], rel=1e-6)


@given(seeds, st.sampled_from([0.0, 1.0, 20.0]))
def test_information_is_the_size_times_the_chance_of_an_empty_circle(seed, outliers):
    points, triangles = random_triangles(seed)
    found = describe(points, triangles, outliers=outliers)
    place = (points[0] + 1j * points[1])[found.corner[: found.number]]
    a, b, c = (abs(place[:, r] - place[:, r - 1]) for r in range(3))
    cross = ((place[:, 1] - place[:, 0]).conj() * (place[:, 2] - place[:, 0])).imag
    circle = math.pi * (a * b * c / (2 * cross)) ** 2
    expected = found.side[: found.number] ** 2 * np.exp(-outliers * circle)
    assert -found.negative_information[: found.number] == pytest.approx(
        expected, rel=1e-6, abs=1e-200
    )


@pytest.mark.parametrize(
    "third", [(0.5, 0.0), (0.5, -1.0), (0.0, 0.0)], ids=["flat", "clockwise", "coincident"]
)
def test_triangles_without_an_inside_are_left_out(third):
    points = np.array([[0.0, 1.0, third[0]], [0.0, 0.0, third[1]]])
    assert describe(points, np.array([[0, 1, 2]], np.int32)).number == 0


def test_no_triangles_have_no_descriptors():
    found = describe(np.zeros((2, 3)), np.empty((0, 3), np.int32))
    assert found.number == 0
    assert len(sort_by_shape(found, 0.1).order) == 0


def fans(mesh):
    """Return the corners of all triangles, not flat, of a point and two of its neighbours."""
    x, y = mesh.points.T
    found = set()
    for i in range(len(mesh)):
        for j, k in itertools.combinations(mesh.one_ring(i).tolist(), 2):
            if (x[j] - x[i]) * (y[k] - y[i]) != (y[j] - y[i]) * (x[k] - x[i]):
                found.add(frozenset((i, j, k)))
    return found


@given(clouds.filter(len))
def test_ring_triangles_are_all_of_a_point_and_two_neighbours_once(cloud):
    mesh = triangulate(cloud)
    triangles = ring_triangles(mesh, in_columns(mesh.points))
    assert triangles.dtype == np.int32
    found = [frozenset(corners) for corners in triangles.tolist()]
    assert len(set(found)) == len(found)
    assert set(found) == fans(mesh) >= {frozenset(t) for t in mesh.triangles.tolist()}
    a, b, c = mesh.points[triangles].transpose(1, 2, 0)
    assert ((b - a)[0] * (c - a)[1] > (b - a)[1] * (c - a)[0]).all()


def test_of_a_large_ring_only_neighbours_near_in_it_make_triangles():
    angle = 2 * np.pi / 24 * np.arange(24)
    wheel = np.vstack([[[0.01, 0.02]], np.column_stack([np.cos(angle), np.sin(angle)])])
    mesh = triangulate(wheel)
    assert len(mesh.one_ring(0)) == 24
    of_hub = [t for t in ring_triangles(mesh, in_columns(mesh.points)).tolist() if 0 in t]
    apart = [abs(j - k) for j, k in (sorted(set(t) - {0}) for t in of_hub)]
    steps = sorted(min(step, 24 - step) for step in apart)
    assert steps == sorted(24 * [*range(1, steps[-1] + 1)])
    assert 1 < steps[-1] < 12


@given(seeds, st.floats(0.01, 100))
def test_density_is_at_least_that_over_the_hull_and_goes_with_the_area(seed, scale):
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(seed).uniform(0, 1, (20, 2))
    mesh, larger = triangulate(points), triangulate(scale * points)
    density = density_of(mesh, in_columns(mesh.points))
    over_hull = density_over_hull(mesh, in_columns(mesh.points))
    assert over_hull == pytest.approx(20 / ConvexHull(points).volume)
    assert density >= over_hull
    assert density_of(larger, in_columns(larger.points)) == pytest.approx(density / scale**2)


def test_an_outlier_hardly_changes_the_density():
    points = np.random.default_rng(3).uniform(0, 1, (60, 2))
    mesh = triangulate(np.vstack([points, [[1e4, 1e4]]]))
    assert 40 < density_of(mesh, in_columns(mesh.points)) < 90


@given(seeds)
def test_distances_of_nearest_points_tell_even_sets_from_rows_and_crowds(seed):
    rng = np.random.default_rng(seed)
    even, crowd = rng.uniform(0, 10, (150, 2)), rng.normal(0, 1, (150, 2)) ** 3
    row = np.vstack([even, np.column_stack([np.arange(20) / 2, np.full(20, 11.0)])])
    for points, expected in ((even, True), (crowd, False), (row, False)):
        mesh = triangulate(points)
        columns = np.array(mesh.points.T, order="C")
        first, second = nearest_two(mesh, columns)
        squared = ((points[:, None] - points) ** 2).sum(axis=2)
        squared[np.diag_indices(len(points))] = np.inf
        assert first == pytest.approx(squared.min(axis=1))
        assert (first <= second).all()
        assert expected or not is_even(mesh, columns, density_of(mesh, columns))


@pytest.mark.parametrize("n", [64, 100, 200, 800])
def test_random_points_are_even_but_for_one_set_in_a_hundred(n):
    even = 0
    for seed in range(200):
        mesh = triangulate(np.random.default_rng(seed).uniform(0, 10, (n, 2)))
        columns = np.array(mesh.points.T, order="C")
        even += is_even(mesh, columns, density_of(mesh, columns))
    assert even >= 196


@pytest.mark.parametrize("kind", sorted(set(INDEPENDENT) - {"uniform"}))
def test_sets_with_structure_are_not_even(kind):
    for seed in range(20):
        mesh = triangulate(INDEPENDENT[kind](np.random.default_rng(seed)))
        columns = np.array(mesh.points.T, order="C")
        assert not is_even(mesh, columns, density_of(mesh, columns))

import itertools
import math

import numpy as np
import pytest
from arranged_sets import INDEPENDENT
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, in_columns, seeds

from fpmatch.lab.points.triangles.given_set import (
    density_of,
    density_over_hull,
    describe,
    is_even,
    ring_triangles,
)
from fpmatch.pointset.delaunay.triangulate import triangulate

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


@given(seeds, st.floats(0.01, 100))
def test_density_is_at_least_that_over_the_hull_and_goes_with_the_area(seed, scale):
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(seed).uniform(0, 1, (20, 2))
    mesh, larger = triangulate(points), triangulate(scale * points)
    density, crowding = density_of(mesh, in_columns(mesh.points))
    over_hull = density_over_hull(mesh, in_columns(mesh.points))
    assert over_hull == pytest.approx(20 / ConvexHull(points).volume)
    assert density == pytest.approx(crowding * over_hull)
    assert crowding >= 1
    there = density_of(larger, in_columns(larger.points))
    assert there == pytest.approx((density / scale**2, crowding))


@pytest.mark.parametrize("n", [64, 100, 200, 800])
def test_random_points_are_even_but_for_one_set_in_a_hundred(n):
    even = 0
    for seed in range(200):
        mesh = triangulate(np.random.default_rng(seed).uniform(0, 10, (n, 2)))
        columns = np.array(mesh.points.T, order="C")
        even += is_even(mesh, columns, density_of(mesh, columns)[1])
    assert even >= 196


@pytest.mark.parametrize("kind", sorted(set(INDEPENDENT) - {"uniform"}))
def test_sets_with_structure_are_not_even(kind):
    for seed in range(20):
        mesh = triangulate(INDEPENDENT[kind](np.random.default_rng(seed)))
        columns = np.array(mesh.points.T, order="C")
        assert not is_even(mesh, columns, density_of(mesh, columns)[1])

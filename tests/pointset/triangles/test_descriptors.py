"""Triangles and their shapes against complex numbers, and compiled against interpreted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import crowded_pixels, seeds

from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.delaunay.triangulation import Triangulation
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.triangles import descriptors
from fpmatch.pointset.triangles.descriptors import (
    TriangleDescriptors,
    delaunay_triangles,
    density_of,
    density_over_hull,
    describe_all,
    describe_large,
    ring_triangles,
    sort_by_shape,
)

moves = st.builds(
    Similarity,
    scale=st.floats(1e-3, 1e3),
    rotation=st.floats(-math.pi, math.pi),
    tx=st.floats(-1e3, 1e3),
    ty=st.floats(-1e3, 1e3),
)

clouds = st.one_of(
    crowded_pixels, seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 9, (20, 2)))
)


def random_triangles(seed: int, n: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Return points (2, N) and the triangles of their mesh."""
    mesh = triangulate(np.random.default_rng(seed).uniform(0, 1, (n, 2)))
    return columns(mesh), mesh.triangles


def columns(mesh: Triangulation) -> np.ndarray:
    return np.array(mesh.points.T, order="C")


def label_with_numpy(
    points: np.ndarray, triangles: np.ndarray, near_tie: float, shortest: float
) -> list[tuple[list[int], complex, float]]:
    """Return corners, shape and side of each triangle as seen from each of its longest sides."""
    place = points[0] + 1j * points[1]
    seen = []
    for corners in triangles.tolist():
        turns = [corners[r:] + corners[:r] for r in range(3)]
        sides = [abs(place[b] - place[a]) for a, b, _ in turns]
        for (a, b, c), side in zip(turns, sides, strict=True):
            z = complex((place[c] - place[a]) / (place[b] - place[a]))
            if side >= near_tie * max(sides) and side >= shortest and z.imag > 0:
                seen.append(([a, b, c], z, float(side)))
    return seen


def check_labels(
    found: TriangleDescriptors, expected: list[tuple[list[int], complex, float]]
) -> None:
    corners, shapes, sides = zip(*expected, strict=True) if expected else ((), (), ())
    assert found.number == len(expected)
    assert found.corner[: found.number].tolist() == list(corners)
    assert found.shape[0, : found.number] == pytest.approx(np.real(shapes), abs=1e-9)
    assert found.shape[1, : found.number] == pytest.approx(np.imag(shapes), abs=1e-9)
    assert found.side[: found.number] == pytest.approx(np.array(sides))


@given(seeds, st.sampled_from([0.5, 0.8, 1.0]), st.sampled_from([0.0, 0.2, 0.5, 9.0]))
def test_labels_agree_with_complex_numbers(seed: int, near_tie: float, shortest: float) -> None:
    points, triangles = random_triangles(seed)
    found = describe_large(points, triangles, near_tie, shortest)
    check_labels(found, label_with_numpy(points, triangles, near_tie, shortest))
    assert found.negative_information.size == 0


@given(seeds, moves)
def test_shapes_stay_when_points_are_turned_scaled_and_shifted(seed: int, move: Similarity) -> None:
    points, triangles = random_triangles(seed)
    there = np.array(move.apply(points.T).T, order="C")
    one, other = (describe_all(each, triangles, 0.0) for each in (points, there))
    assert one.number == other.number == len(triangles)
    assert (one.corner[: one.number] == other.corner[: one.number]).all()
    # a shift of 1000 leaves points of extent 0.001 ten digits; a flat triangle needs a few
    blur = 1e-9 + 1e-12 * 1e3 / move.scale
    assert other.shape[:, : one.number] == pytest.approx(one.shape[:, : one.number], abs=blur)
    assert other.side[: one.number] == pytest.approx(move.scale * one.side[: one.number], rel=1e-6)


@given(seeds, st.sampled_from([0.0, 1.0, 20.0]))
def test_a_triangle_tells_its_size_where_its_circle_is_likely_to_stay_empty(
    seed: int, strangers: float
) -> None:
    points, triangles = random_triangles(seed)
    found = describe_all(points, triangles, strangers)
    place = (points[0] + 1j * points[1])[found.corner[: found.number]]
    a, b, c = (abs(place[:, r] - place[:, r - 1]) for r in range(3))
    cross = ((place[:, 1] - place[:, 0]).conj() * (place[:, 2] - place[:, 0])).imag
    circle = math.pi * (a * b * c / (2 * cross)) ** 2
    expected = found.side[: found.number] ** 2 * np.exp(-strangers * circle)
    assert -found.negative_information[: found.number] == pytest.approx(
        expected, rel=1e-6, abs=1e-200
    )


def test_an_equilateral_triangle_is_seen_from_every_side() -> None:
    points = np.array([[0.0, 1.0, 0.5], [0.0, 0.0, math.sqrt(0.75)]])
    found = describe_large(points, np.array([[0, 1, 2]], np.int32), 0.9, 0.0)
    assert found.corner.tolist() == [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
    assert found.shape == pytest.approx(np.outer([0.5, math.sqrt(0.75)], np.ones(3)))


def test_a_square_is_halved_into_triangles_seen_from_its_diagonal() -> None:
    points = np.array([[0.0, 2.0, 2.0, 0.0], [0.0, 0.0, 2.0, 2.0]])
    found = describe_all(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32), 0.0)
    assert found.number == 2
    assert found.corner[:2].tolist() == [[2, 0, 1], [0, 2, 3]]
    assert found.shape[:, :2].tolist() == [[0.5, 0.5], [0.5, 0.5]]


@pytest.mark.parametrize(
    "third", [(0.5, 0.0), (0.5, -1.0), (0.0, 0.0)], ids=["flat", "clockwise", "coincident"]
)
def test_triangles_without_an_inside_are_left_out(third: tuple[float, float]) -> None:
    points = np.array([[0.0, 1.0, third[0]], [0.0, 0.0, third[1]]])
    assert describe_all(points, np.array([[0, 1, 2]], np.int32), 1.0).number == 0


def test_no_triangles_have_no_labels() -> None:
    found = describe_all(np.zeros((2, 3)), np.empty((0, 3), np.int32), 1.0)
    assert found.number == 0
    assert len(sort_by_shape(found, 0.1).order) == 0


def fans(mesh: Triangulation) -> set[frozenset[int]]:
    """Return the corners of all triangles, not flat, of a point and two of its neighbours."""
    x, y = mesh.points.T
    found = set()
    for i in range(len(mesh)):
        for j, k in itertools.combinations(mesh.one_ring(i).tolist(), 2):
            if (x[j] - x[i]) * (y[k] - y[i]) != (y[j] - y[i]) * (x[k] - x[i]):
                found.add(frozenset((i, j, k)))
    return found


@given(clouds)
def test_ring_triangles_are_all_of_a_point_and_two_neighbours_once(cloud: np.ndarray) -> None:
    mesh = triangulate(cloud)
    triangles = ring_triangles(mesh, columns(mesh))
    assert triangles.dtype == np.int32
    found = [frozenset(corners) for corners in triangles.tolist()]
    assert len(set(found)) == len(found)
    assert set(found) == fans(mesh)
    a, b, c = mesh.points[triangles].transpose(1, 2, 0)
    assert ((b - a)[0] * (c - a)[1] > (b - a)[1] * (c - a)[0]).all()


@given(clouds)
def test_ring_triangles_hold_those_of_the_mesh(cloud: np.ndarray) -> None:
    mesh = triangulate(cloud)
    found = {frozenset(corners) for corners in ring_triangles(mesh, columns(mesh)).tolist()}
    assert found >= {frozenset(t) for t in delaunay_triangles(mesh, columns(mesh)).tolist()}


def test_of_a_large_ring_only_neighbours_near_in_it_make_triangles() -> None:
    angle = 2 * np.pi / 24 * np.arange(24)
    wheel = np.vstack([[[0.01, 0.02]], np.column_stack([np.cos(angle), np.sin(angle)])])
    mesh = triangulate(wheel)
    assert len(mesh.one_ring(0)) == 24
    of_hub = [t for t in ring_triangles(mesh, columns(mesh)).tolist() if 0 in t]
    apart = [abs(j - k) for j, k in (sorted(set(t) - {0}) for t in of_hub)]
    steps = sorted(min(step, 24 - step) for step in apart)
    assert steps == sorted(24 * [*range(1, steps[-1] + 1)])
    assert 1 < steps[-1] < 12


def test_density_of_a_lattice_is_that_over_its_hull() -> None:
    lattice = np.argwhere(np.ones((5, 5))).astype(float)
    mesh = triangulate(lattice)
    assert density_over_hull(mesh, columns(mesh)) == 25 / 16
    assert density_of(mesh, columns(mesh)) == 25 / 16


@given(seeds, st.floats(0.01, 100))
def test_density_is_at_least_that_over_the_hull_and_goes_with_the_area(
    seed: int, scale: float
) -> None:
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(seed).uniform(0, 1, (20, 2))
    mesh, larger = triangulate(points), triangulate(scale * points)
    density = density_of(mesh, columns(mesh))
    over_hull = density_over_hull(mesh, columns(mesh))
    assert over_hull == pytest.approx(20 / ConvexHull(points).volume)
    assert density >= over_hull
    assert density_of(larger, columns(larger)) == pytest.approx(density / scale**2)


def test_an_outlier_hardly_changes_the_density() -> None:
    points = np.random.default_rng(3).uniform(0, 1, (60, 2))
    mesh = triangulate(np.vstack([points, [[1e4, 1e4]]]))
    assert 40 < density_of(mesh, columns(mesh)) < 90


@given(seeds, st.sampled_from([0.001, 0.1, 3.0]))
def test_shapes_are_found_in_their_bins(seed: int, widest: float) -> None:
    points, triangles = random_triangles(seed)
    found = describe_large(points, triangles, 0.8, 0.0)
    bins = sort_by_shape(found, widest)
    assert sorted(bins.order) == list(range(found.number))
    for x, y in found.shape[:, : found.number].T:
        k = bins.order[bins.nearest(x, y, widest**2)]
        assert found.shape[:, k].tolist() == [x, y]


@given(clouds)
@settings(max_examples=10)
def test_compiled_and_interpreted_agree_to_the_last_bit(
    interpreted: Callable[[str], ModuleType], cloud: np.ndarray
) -> None:
    mesh = triangulate(cloud)
    results = []
    for plain in (False, True):
        with pytest.MonkeyPatch.context() as patch:
            if plain:
                patch.setattr(descriptors, "kernel", interpreted("_triangle_kernel"))
            triangles = ring_triangles(mesh, columns(mesh))
            large = describe_large(columns(mesh), triangles, 0.8, 0.5)
            found = describe_all(columns(mesh), mesh.triangles, 0.3)
            density = density_of(mesh, columns(mesh)) if len(mesh.triangles) else 0.0
            results.append((triangles, large, found, density))
    (triangles, large, found, density), (same_triangles, same_large, same, same_density) = results
    assert triangles.tolist() == same_triangles.tolist()
    assert density == same_density
    for one, other in ((large, same_large), (found, same)):
        n = one.number
        assert n == other.number
        assert one.corner[:n].tolist() == other.corner[:n].tolist()
        assert one.shape[:, :n].tolist() == other.shape[:, :n].tolist()
        assert one.side[:n].tolist() == other.side[:n].tolist()
        assert one.negative_information[:n].tolist() == other.negative_information[:n].tolist()

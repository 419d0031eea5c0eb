from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, crowded_pixels, seeds
from scipy.spatial import Delaunay

from fpmatch.errors import PointSetError
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.delaunay.triangulation import Triangulation

Points = np.ndarray


def edge_set(mesh: Triangulation) -> set[tuple[int, int]]:
    return {(a, b) for a, b in mesh.edges.tolist()}


def triangles_by_place(mesh: Triangulation) -> set[tuple[tuple[float, ...], ...]]:
    return {tuple(sorted(map(tuple, corner))) for corner in mesh.points[mesh.triangles].tolist()}


def in_circle(a: list[int], b: list[int], c: list[int], d: list[int]) -> int:
    """Return, exactly, a number above 0 where d is inside the circle through a, b, c (ccw)."""
    rows = [(x - d[0], y - d[1], (x - d[0]) ** 2 + (y - d[1]) ** 2) for x, y in (a, b, c)]
    (ax, ay, al), (bx, by, bl), (cx, cy, cl) = rows
    return al * (bx * cy - by * cx) + bl * (cx * ay - cy * ax) + cl * (ax * by - ay * bx)


def check_structure(mesh: Triangulation) -> None:
    n = len(mesh)
    edges = edge_set(mesh)
    assert len(edges) == len(mesh.edges)
    assert all(0 <= a < b < n for a, b in edges)
    assert mesh.ring_start[0] == 0
    assert mesh.ring_start[-1] == len(mesh.ring)
    for i in range(n):
        ring = mesh.one_ring(i).tolist()
        assert len(set(ring)) == len(ring)
        assert bool(ring) or n == 1
        assert all((min(i, j), max(i, j)) in edges for j in ring)
    for i in mesh.interior.nonzero()[0]:
        ring = mesh.one_ring(i).tolist()
        assert len(ring) >= 3
        for a, b in itertools.pairwise([*ring, ring[0]]):
            assert (min(a, b), max(a, b)) in edges
    assert not mesh.interior[mesh.hull].any()


@given(any_finite_points)
def test_every_finite_set_has_a_sound_mesh(points: Points) -> None:
    check_structure(triangulate(points))


@given(crowded_pixels)
def test_crowded_pixels_get_an_exact_delaunay_triangulation(points: Points) -> None:
    mesh = triangulate(points)
    check_structure(mesh)
    whole = points.astype(int).tolist()
    for i, j, k in mesh.triangles.tolist():
        a, b, c = whole[i], whole[j], whole[k]
        assert (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0
        assert all(in_circle(a, b, c, d) <= 0 for d in whole)
    distinct = len(np.unique(points, axis=0))
    if len(mesh.triangles):
        assert len(mesh.triangles) == 2 * distinct - 2 - len(mesh.hull)


@given(crowded_pixels, seeds)
def test_triangles_do_not_depend_on_the_order_of_the_points(points: Points, seed: int) -> None:
    shuffled = np.random.default_rng(seed).permutation(points)
    assert triangles_by_place(triangulate(points)) == triangles_by_place(triangulate(shuffled))


def edges_of_qhull(points: Points) -> set[tuple[int, int]]:
    corners = Delaunay(points).simplices
    sides = np.sort(np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
    return {(a, b) for a, b in sides.tolist()}


@given(seeds, st.integers(3, 60))
def test_agrees_with_qhull_in_general_position(seed: int, n: int) -> None:
    points = np.random.default_rng(seed).uniform(0, 400, (n, 2))
    assert edge_set(triangulate(points)) == edges_of_qhull(points)


@pytest.mark.parametrize("n", [1000, 20_000])
def test_agrees_with_qhull_on_large_sets(rng: np.random.Generator, n: int) -> None:
    for points in (rng.random((n, 2)), rng.normal(0, 1, (n, 2))):
        assert edge_set(triangulate(points)) == edges_of_qhull(points)


@given(seeds)
def test_rings_turn_counter_clockwise(seed: int) -> None:
    mesh = triangulate(np.random.default_rng(seed).uniform(0, 400, (25, 2)))
    for i in mesh.interior.nonzero()[0]:
        away = (mesh.points[mesh.one_ring(i)] - mesh.points[i]) @ [1, 1j]
        turn = np.angle(np.roll(away, -1) / away)
        assert (turn > 0).all()
        assert turn.sum() == pytest.approx(2 * np.pi)


def test_hull_runs_counter_clockwise_from_the_smallest_point() -> None:
    mesh = triangulate([[4, 4], [2, 1], [0, 4], [4, 0], [0, 0], [2, 0]])
    assert mesh.hull.tolist() == [4, 5, 3, 0, 2]
    assert mesh.interior.tolist() == [False, True, False, False, False, False]


@pytest.mark.parametrize("n", [0, 1, 2])
def test_fewer_than_three_points_have_no_triangles(n: int) -> None:
    mesh = triangulate(np.arange(2 * n).reshape(n, 2))
    assert mesh.triangles.shape == (0, 3)
    assert mesh.edges.tolist() == [[0, 1]][: max(n - 1, 0)]
    assert len(mesh.hull) == n


def test_points_on_a_line_are_joined_along_it() -> None:
    mesh = triangulate([[3, 3], [0, 0], [2, 2], [1, 1]])
    assert sorted(mesh.edges.tolist()) == [[0, 2], [1, 3], [2, 3]]
    assert mesh.hull.tolist() == [1, 3, 2, 0]
    assert mesh.one_ring(3).tolist() == [1, 2]
    assert not len(mesh.triangles)


def test_first_of_coincident_points_stands_for_the_rest() -> None:
    mesh = triangulate([[0, 0], [4, 0], [2, 1], [0, 4], [2, 1], [4, 4], [2, 1]])
    assert mesh.interior.nonzero()[0].tolist() == [2]
    assert mesh.one_ring(2).tolist() == [0, 1, 5, 3]
    assert mesh.one_ring(4).tolist() == mesh.one_ring(6).tolist() == [2]
    assert {(2, 4), (2, 6)} <= edge_set(mesh)


def test_wholly_coincident_points_are_joined_to_the_first() -> None:
    mesh = triangulate(np.full((3, 2), 7.5))
    assert mesh.edges.tolist() == [[0, 1], [0, 2]]
    assert mesh.one_ring(0).tolist() == [1, 2]
    assert not mesh.interior.any()


def test_co_circular_points_are_fanned_out_from_the_smallest() -> None:
    octagon = [[1, 0], [2, 0], [3, 1], [3, 2], [2, 3], [1, 3], [0, 2], [0, 1]]
    mesh = triangulate(octagon)
    assert len(mesh.triangles) == 6
    assert (mesh.triangles == 7).any(axis=1).all()


def test_result_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        triangulate([[0, 0], [1, 0], [0, 1]]).ring[0] = 1


@pytest.mark.parametrize("bad", [[[0, np.nan]], [[0, np.inf]], [1, 2, 3], np.zeros((2, 3))])
def test_malformed_points_are_refused(bad: object) -> None:
    with pytest.raises(PointSetError):
        triangulate(bad)  # type: ignore[arg-type]

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import seeds
from scipy.spatial import Delaunay

from fpmatch.errors import PointSetError
from fpmatch.pointset.delaunay._delaunay_kernel import COMPILED
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.delaunay.triangulation import Triangulation

Points = np.ndarray


def edge_set(mesh: Triangulation) -> set[tuple[int, int]]:
    return {(a, b) for a, b in mesh.edges.tolist()}


def edges_of_qhull(points: Points) -> set[tuple[int, int]]:
    corners = Delaunay(points).simplices
    sides = np.sort(np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
    return {(a, b) for a, b in sides.tolist()}


@given(seeds, st.integers(3, 60))
def test_agrees_with_qhull_in_general_position(seed: int, n: int) -> None:
    points = np.random.default_rng(seed).uniform(0, 400, (n, 2))
    assert edge_set(triangulate(points)) == edges_of_qhull(points)


@pytest.mark.parametrize("n", [1000, 20_000] if COMPILED else [1000])
def test_agrees_with_qhull_on_large_sets(rng: np.random.Generator, n: int) -> None:
    for points in (rng.random((n, 2)), rng.normal(0, 1, (n, 2))):
        assert edge_set(triangulate(points)) == edges_of_qhull(points)


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

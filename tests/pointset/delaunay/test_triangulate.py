import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import seeds
from scipy.spatial import Delaunay

from fpmatch.pointset.delaunay._delaunay_kernel import COMPILED
from fpmatch.pointset.delaunay.triangulate import triangulate


def edge_set(mesh):
    return {(a, b) for a, b in mesh.edges.tolist()}


@pytest.mark.parametrize("n", [20, 60, 1000, 20_000] if COMPILED else [20, 60, 1000])
def test_agrees_with_qhull(rng, n):
    for points in (rng.random((n, 2)), rng.normal(0, 1, (n, 2))):
        corners = Delaunay(points).simplices
        sides = np.sort(np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
        assert edge_set(triangulate(points)) == {(a, b) for a, b in sides.tolist()}


def test_wholly_coincident_points_are_joined_to_the_first():
    mesh = triangulate(np.full((3, 2), 7.5))
    assert mesh.edges.tolist() == [[0, 1], [0, 2]]
    assert mesh.one_ring(0).tolist() == [1, 2]
    assert not mesh.interior.any()


def test_result_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        triangulate([[0, 0], [1, 0], [0, 1]]).ring[0] = 1


@given(seeds, st.integers(0, 30), st.floats(-np.pi, np.pi), st.sampled_from([1e-300, 1.0, 1e85]))
def test_points_on_any_line_form_a_path(seed, n, turn, size):
    rng = np.random.default_rng(seed)
    place = rng.permutation(n).astype(float)
    points = size * np.column_stack([place * np.cos(turn), place * np.sin(turn)])
    mesh = triangulate(points)
    joined = place[mesh.edges]
    assert sorted(map(sorted, joined.tolist())) == [[k, k + 1] for k in range(n - 1)]
    assert (np.abs(np.diff(place[mesh.hull])) == 1).all()
    assert not len(mesh.triangles)
    assert not mesh.interior.any()
    for i in range(n):
        assert sorted(place[mesh.one_ring(i)]) == [
            k for k in (place[i] - 1, place[i] + 1) if 0 <= k < n
        ]


@pytest.mark.parametrize("flat", [True, False])
def test_flatter_than_a_billionth_is_a_line(flat):
    points = np.array([[0, 0], [1, 0.9e-9 if flat else 1.1e-9], [2, -1.0e-15], [1.5, 1e-12]])
    points[:, 1] *= 2.0
    assert (len(triangulate(points).triangles) == 0) == flat


def test_twins_on_a_line_hang_on_their_first():
    mesh = triangulate([[2, 0], [0, 0], [2, 0], [1, 0]])
    assert mesh.hull.tolist() == [1, 3, 0]
    assert sorted(mesh.edges.tolist()) == [[0, 2], [0, 3], [1, 3]]
    assert [mesh.one_ring(i).tolist() for i in range(4)] == [[3], [3], [0], [0, 1]]

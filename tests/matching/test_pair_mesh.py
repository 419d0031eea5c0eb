"""The mesh of pairs: the kernel against the reference and Qhull, and what it measures."""

from collections import namedtuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import moved, on_pixels, plane, seeds, spread_points
from scipy.spatial import Delaunay

from fpmatch.matching.parameters import USUAL
from fpmatch.matching.pipeline._kernels import _pair_mesh_kernel as kernel
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.matching.reference.pair_mesh import measure

P = USUAL
MOST = 30
FRAME = 8
FAR_AWAY = 1e6  # px, from the nearest pair, where no ring has any

AT_REST = (1.0, 0.0, 0.0, 0.0)

Case = namedtuple("Case", "a b partner transform")


def transform_of(turn, shift, scale=1.0):
    linear = scale * np.exp(1j * turn)
    return linear.real, linear.imag, shift.real, shift.imag


def some_case(seed, most=MOST):
    """Return a print, a copy that is moved and worn, pairs of which a few are false, and a fit."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, most + 1))
    a = spread_points(rng, n, 8.0)
    turn, shift = rng.uniform(-3, 3), complex(*rng.uniform(-90, 90, 2))
    b = moved(a, turn, shift)
    b[:2] += rng.normal(0, 4, (2, n))
    partner = np.where(rng.random(n) < rng.uniform(0, 1), np.arange(n), -1).astype(np.int32)
    false = np.flatnonzero((partner >= 0) & (rng.random(n) < 0.15))
    partner[false] = partner[rng.permutation(false)]
    return Case(a, b, partner, transform_of(turn + 0.1, shift + 3, rng.uniform(0.95, 1.05)))


def pairing_of(case):
    """Return the pairs of a case as the reference has them."""
    c, s, x, y = case.transform
    move = complex(c, s), complex(x, y)
    return Pairing(case.a, case.b, case.partner, np.ones(case.a.shape[1]), move)


def mesh_of(case, parameters=P, room=3):
    """Return the kernel's mesh, with room for more minutiae, which must not matter."""
    mesh = kernel.PairMesh(parameters, case.a.shape[1] + room)
    fill(mesh, case)
    return mesh


def fill(mesh, case, *, measured=True):
    """Build a mesh and predict by it; return for how many minutiae it does."""
    n = case.a.shape[1]
    mesh.build(case.a, n, case.b, case.partner, *case.transform)
    return mesh.predict(case.a, n, case.b, case.partner, *case.transform, measured)


def predicted_by(mesh, n):
    return np.array(mesh.predicted)[:, :n]


def vertices_of(mesh):
    """Return the vertices of a mesh in print A and in print B."""
    n = mesh.vertices
    arrays = np.array([mesh.ax[:n], mesh.ay[:n]]), np.array([mesh.bx[:n], mesh.by[:n]])
    return tuple(map(plane, arrays))


def triangles_of(mesh):
    return np.array(mesh.corner)[: mesh.triangles]


def sorted_corners(triangles):
    return {tuple(sorted(corners)) for corners in triangles.tolist()}


def check_whole(mesh):
    """Check that a mesh has its octagon covered once, by triangles that go counter-clockwise."""
    z, _ = vertices_of(mesh)
    assert mesh.triangles == 2 * mesh.vertices - FRAME - 2
    p, q, r = z[triangles_of(mesh)].T
    area = ((q - p).conj() * (r - p)).imag / 2
    assert (area > 0).all()
    octagon = z[:FRAME]
    expected = np.sum((octagon.conj() * np.roll(octagon, -1)).imag) / 2
    assert area.sum() == pytest.approx(expected, rel=1e-9)


@given(seeds)
def test_the_mesh_is_that_of_the_reference(seed):
    case = some_case(seed)
    mesh, expected = mesh_of(case), pairing_of(case).mesh[0]
    z, there = vertices_of(mesh)
    assert z == pytest.approx(expected.vertex)
    assert there == pytest.approx(expected.image)
    assert np.array(mesh.owner)[: mesh.vertices].tolist() == expected.owner.tolist()
    vertex_of = np.full(case.a.shape[1], -1)
    vertex_of[expected.owner[FRAME:]] = np.arange(FRAME, mesh.vertices)
    assert np.array(mesh.vertex_of)[: len(vertex_of)].tolist() == vertex_of.tolist()
    check_whole(mesh)
    if mesh.vertices > FRAME:  # else all points are on one circle
        assert sorted_corners(triangles_of(mesh)) == sorted_corners(expected.triangles)


@given(seeds)
def test_predictions_and_measurements_agree_with_the_reference(seed):
    case = some_case(seed)
    n, mesh = case.a.shape[1], mesh_of(case)
    expected, place, direction, nearest = pairing_of(case).mesh
    rows = place.real, place.imag, direction.real, direction.imag
    assert predicted_by(mesh, n) == pytest.approx(np.array(rows), abs=1e-6)
    assert np.array(mesh.nearest)[:n] == pytest.approx(nearest)
    sums = measure(expected, plane(case.b), case.partner, place)
    expected_sums = [sums[name] for name in ("places", "weights", "fullness")]
    assert [mesh.places, mesh.weights, mesh.full] == pytest.approx(expected_sums, abs=1e-6)


@given(seeds)
def test_an_affine_map_is_predicted_exactly_where_pairs_close_the_ring(seed):
    """Shape-preserving weights do not change under affine maps; the frame's map is none."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, 40)
    linear = np.eye(2) + rng.uniform(-0.2, 0.2, (2, 2))
    b = a.copy()
    b[:2] = linear @ a[:2] + rng.uniform(-50, 50, (2, 1))
    mesh = mesh_of(Case(a, b, np.arange(40, dtype=np.int32), AT_REST))
    corners, closed = triangles_of(mesh), np.ones(mesh.vertices, bool)
    closed[corners[(corners < FRAME).any(axis=1)]] = False
    closed = closed[FRAME:]
    assert closed.sum() >= 10
    assert predicted_by(mesh, 40)[:2, closed] == pytest.approx(b[:2, closed], abs=1e-6)


@given(seeds, st.floats(-14, -2), st.sampled_from(["line", "pixels", "circle", "twice"]))
@settings(max_examples=200)
def test_pairs_that_nearly_coincide_leave_the_mesh_whole(seed, exponent, kind):
    """Rounding may leave a minutia out of the mesh, but makes no hole in it."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 2 * MOST))
    along = rng.integers(0, 36, n)
    z = {
        "line": np.exp(1j) * rng.uniform(0, 300, n),
        "pixels": plane(on_pixels(rng, n)),
        "circle": 100 * np.exp(1j * np.pi / 18 * along),
        "twice": np.repeat(plane(spread_points(rng, n // 2 + 1, 2.0)), 2)[:n],
    }[kind]
    noise = rng.normal(0, 10**exponent, (2, n))
    a = np.vstack([z.real + noise[0], z.imag + noise[1], np.ones(n), np.zeros(n)])
    mesh = mesh_of(Case(a, a, np.arange(n, dtype=np.int32), AT_REST))
    check_whole(mesh)
    assert predicted_by(mesh, n) == pytest.approx(a, abs=1e-3)


def test_a_mesh_is_filled_to_its_last_place():
    n = 2000
    a = np.vstack([np.random.default_rng(1).uniform(0, 2000, (2, n)), np.ones(n), np.zeros(n)])
    case = Case(a, moved(a, 1.0), np.arange(n, dtype=np.int32), transform_of(1.0, 0j))
    mesh = mesh_of(case, room=0)
    assert mesh.vertices == n + FRAME
    z, _ = vertices_of(mesh)
    by_qhull = Delaunay(np.column_stack([z.real, z.imag])).simplices
    assert sorted_corners(triangles_of(mesh)) == sorted_corners(by_qhull)
    assert predicted_by(mesh, n) == pytest.approx(case.b, abs=1e-5)

"""The mesh of pairs: the kernel against twins made of scipy and numpy, and what it measures."""

import math
from collections import namedtuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import COMPILED, moved, on_pixels, plane, seeds, spread_points
from scipy.spatial import Delaunay

from fpmatch.matching.pipeline._kernels import _pair_mesh_kernel as kernel
from fpmatch.matching.pipeline.alignment import PairMeshParameters
from fpmatch.pointset.paper.parametrize import boundary_angles, shape_preserving_weights

P = PairMeshParameters()
MOST = 30 if COMPILED else 15
FRAME = 8
NEAR2 = 1e-3  # px², which keeps the weight of a line of no length finite
STRAIN_PX = 8.0
FAR_AWAY = 1e6  # px, from the nearest pair, where no ring has any

AT_REST = (1.0, 0.0, 0.0, 0.0)

Case = namedtuple("Case", "a b partner transform")

Measured = namedtuple("Measured", "place_agreement weight_agreement fullness turned edges strain")


def mapped(z, transform):
    c, s, x, y = transform
    return complex(x, y) + complex(c, s) * z


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


def mesh_of(case, module=kernel, parameters=P, room=3):
    """Return the kernel's mesh, with room for more minutiae, which must not matter."""
    mesh = module.PairMesh(parameters, case.a.shape[1] + room)
    fill(mesh, case)
    return mesh


def fill(mesh, case, *, measured=True):
    """Build a mesh and predict by it; return for how many minutiae it does."""
    n = case.a.shape[1]
    mesh.build(case.a, n, case.b, case.partner, *case.transform)
    return mesh.predict(case.a, n, case.b, case.partner, *case.transform, measured)


def predicted_by(mesh, n):
    return np.array(mesh.predicted)[:, :n]


def measured_by(mesh, n):
    shares = mesh.place_agreement, mesh.weight_agreement, mesh.fullness
    sums = mesh.turned, mesh.edges, mesh.mean_strain()
    return Measured(*(np.array(share)[:n] for share in shares), *sums)


def vertices_of(mesh):
    """Return the vertices of a mesh in print A and in print B."""
    n = mesh.vertices
    arrays = np.array([mesh.ax[:n], mesh.ay[:n]]), np.array([mesh.bx[:n], mesh.by[:n]])
    return tuple(map(plane, arrays))


def shown(mesh, n):
    """Return all that a mesh shows of n minutiae, to be compared to the last bit."""
    arrays = [*vertices_of(mesh), np.array(mesh.owner)[: mesh.vertices], triangles_of(mesh)]
    arrays += [np.array(array)[:n] for array in (mesh.vertex_of, mesh.nearest)]
    of_minutiae = mesh.place_agreement, mesh.weight_agreement, mesh.fullness
    arrays += [*(np.array(array)[:n] for array in of_minutiae), predicted_by(mesh, n)]
    sums = [mesh.places, mesh.weights, mesh.full, mesh.strain, mesh.turned, mesh.edges]
    return [*(array.tolist() for array in arrays), *sums]


def triangles_of(mesh):
    return np.array(mesh.corner)[: mesh.triangles]


def frame_twin(a, margin=P.frame_margin_px):
    """Return the points of an octagon round the print."""
    low, high = a[:2].min(axis=1), a[:2].max(axis=1)
    radius = math.hypot(*(high - low)) / 2 + margin
    return complex(*(low + high) / 2) + radius * np.exp(2j * np.pi * np.arange(FRAME) / FRAME)


def triangulated(z):
    """Return Qhull's triangles."""
    return sorted_corners(Delaunay(np.column_stack([z.real, z.imag])).simplices)


def sorted_corners(triangles):
    return {tuple(sorted(corners)) for corners in triangles.tolist()}


def predict_twin(case):
    """Return predicted minutiae, distances from the nearest other pair, and measurements.

    Each minutia is a point of a triangulation of its own, with the frame and the other pairs.
    """
    n = case.a.shape[1]
    frame = frame_twin(case.a)
    predicted, nearest = np.empty((4, n)), np.full(n, FAR_AWAY)
    places, weights, full = np.zeros((3, n))
    turned = edges = 0
    strain = 0.0
    for i, here in enumerate(plane(case.a)):
        others = [k for k in np.flatnonzero(case.partner >= 0) if k != i]
        z_a = np.concatenate([frame, plane(case.a)[others], [here]])
        z_b = np.concatenate([mapped(frame, case.transform), plane(case.b)[case.partner[others]]])
        last = len(z_a) - 1
        ring = {v for corners in triangulated(z_a) if last in corners for v in corners} - {last}
        ring = sorted(ring, key=lambda v: float(np.angle(z_a[v] - here)))
        p, q = z_a[ring], z_b[ring]
        flat_p, flat_q = (np.column_stack([z.real, z.imag]) for z in (p, q))
        on_pairs = np.array(ring) >= FRAME
        share = shape_preserving_weights(flat_p, [here.real, here.imag])
        image = share @ q
        by_length = share / (abs(p - here) ** 2 + NEAR2)
        turn = np.sum(by_length * (q - image) * (p - here).conj())
        direction = turn / abs(turn) * complex(*case.a[2:, i])
        predicted[:, i] = image.real, image.imag, direction.real, direction.imag
        nearest[i] = abs(p - here)[on_pairs].min(initial=FAR_AWAY)
        if case.partner[i] < 0:
            continue
        true = plane(case.b)[case.partner[i]]
        off = abs(image - true) / (P.residual_px + P.residual_per_px * (share @ abs(p - here)))
        weights[i] = math.exp(-0.5 * off**2)
        difference = boundary_angles(flat_p) - boundary_angles(flat_q)
        places[i] = math.exp(-0.5 * difference.var() / P.place_tolerance**2)
        full[i] = share[on_pairs].sum()
        spokes = q - true
        turned += int(np.sum((spokes.conj() * np.roll(spokes, -1)).imag <= 0))
        lengths = abs(p - here)[on_pairs], abs(spokes)[on_pairs]
        edges += len(lengths[0])
        strain += np.sum(abs(lengths[0] - lengths[1]) / (sum(lengths) / 2 + STRAIN_PX))
    mean = strain / edges if edges else 0.0
    return predicted, nearest, Measured(places, weights, full, turned, edges, mean)


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


def check_triangulation(mesh, tolerance=1e-6):
    """Check that a mesh is whole and, but for rounding (px²), Delaunay's."""
    check_whole(mesh)
    z, _ = vertices_of(mesh)
    p, q, r = z[triangles_of(mesh)].T
    u, v = q - p, r - p
    middle = p + 1j * (u * abs(v) ** 2 - v * abs(u) ** 2) / (2 * (u.conj() * v).imag)
    radius2 = abs(middle - p) ** 2
    inside = radius2[:, None] - abs(z[None, :] - middle[:, None]) ** 2
    assert (inside <= tolerance * np.maximum(1, radius2[:, None])).all()


@given(seeds)
def test_triangles_are_those_of_qhull(seed):
    case = some_case(seed)
    mesh = mesh_of(case)
    paired = np.flatnonzero(case.partner >= 0)
    z, there = vertices_of(mesh)
    assert z == pytest.approx(np.concatenate([frame_twin(case.a), plane(case.a)[paired]]))
    expected = [mapped(z[:FRAME], case.transform), plane(case.b)[case.partner[paired]]]
    assert there == pytest.approx(np.concatenate(expected))
    assert np.array(mesh.owner)[: mesh.vertices].tolist() == [-1] * FRAME + paired.tolist()
    vertex_of = np.full(case.a.shape[1], -1)
    vertex_of[paired] = FRAME + np.arange(len(paired))
    assert np.array(mesh.vertex_of)[: len(vertex_of)].tolist() == vertex_of.tolist()
    check_triangulation(mesh)
    if len(paired):  # else all points are on one circle
        assert sorted_corners(triangles_of(mesh)) == triangulated(z)


@given(seeds)
def test_predictions_and_measurements_agree_with_their_twin(seed):
    case = some_case(seed, 20 if COMPILED else 8)
    n, pairs = case.a.shape[1], np.flatnonzero(case.partner >= 0)
    mesh = mesh_of(case)
    if not len(pairs):
        return
    predicted, nearest, expected = predict_twin(case)
    found = measured_by(mesh, n)
    nearest[pairs if len(pairs) == 1 else []] = FAR_AWAY
    assert predicted_by(mesh, n) == pytest.approx(predicted, abs=1e-6)
    assert np.array(mesh.nearest)[:n] == pytest.approx(nearest)
    sums = []
    for name in ("place_agreement", "weight_agreement", "fullness"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), abs=1e-6)
        sums.append(getattr(expected, name).sum())
    assert [mesh.places, mesh.weights, mesh.full] == pytest.approx(sums)
    assert (found.turned, found.edges) == (expected.turned, expected.edges)
    assert found.strain == pytest.approx(expected.strain)


@given(seeds)
def test_an_affine_map_is_predicted_exactly_where_pairs_close_the_ring(seed):
    """Shape-preserving weights do not change under affine maps; the frame's map is none."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, 40)
    linear = np.eye(2) + rng.uniform(-0.2, 0.2, (2, 2))
    b = a.copy()
    b[:2] = linear @ a[:2] + rng.uniform(-50, 50, (2, 1))
    mesh = mesh_of(Case(a, b, np.arange(40, dtype=np.int32), AT_REST))
    found = measured_by(mesh, 40)
    closed = found.fullness > 1 - 1e-12
    assert closed.sum() >= 10
    assert predicted_by(mesh, 40)[:2, closed] == pytest.approx(b[:2, closed], abs=1e-6)
    assert found.weight_agreement[closed] == pytest.approx(1.0)


def test_without_pairs_the_prediction_is_that_of_the_frame():
    a = spread_points(np.random.default_rng(2), 6)
    expected = moved(a, 0.7, 30 - 8j, 1.02)
    transform = transform_of(0.7, 30 - 8j, 1.02)
    mesh = mesh_of(Case(a, expected, np.full(6, -1, np.int32), transform))
    assert (mesh.vertices, mesh.triangles) == (FRAME, FRAME - 2)
    assert predicted_by(mesh, 6) == pytest.approx(expected, abs=1e-6)
    assert np.array(mesh.nearest)[:6] == pytest.approx(FAR_AWAY)
    assert (mesh.places, mesh.weights, mesh.full, mesh.mean_strain()) == (0, 0, 0, 0)


@given(seeds)
def test_crowded_pixels_make_a_whole_mesh(seed):
    """Of coincident minutiae the first is a vertex; collinear and co-circular ones all are."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, MOST + 1))
    a = on_pixels(rng, n)
    partner = np.where(rng.random(n) < 0.8, np.arange(n), -1).astype(np.int32)
    mesh = mesh_of(Case(a, a, partner, AT_REST))
    check_triangulation(mesh)
    is_vertex = np.array(mesh.vertex_of)[:n] >= 0
    seen = set()
    for i, z in enumerate(plane(a)):
        assert is_vertex[i] == (partner[i] >= 0 and z not in seen)
        seen |= {z} if is_vertex[i] else set()
    assert mesh.turned == 0
    assert measured_by(mesh, n).weight_agreement[is_vertex] == pytest.approx(1.0)
    assert predicted_by(mesh, n) == pytest.approx(a, abs=1e-6)


@given(st.integers(3, 25), st.floats(-3.2, 3.2), st.booleans())
def test_pairs_on_one_line(n, turn, regular):
    along = np.arange(n) * 11.0 if regular else np.sort(np.random.default_rng(n).uniform(0, 250, n))
    a = moved(np.array([along, np.zeros(n), np.ones(n), np.zeros(n)]), turn, 100 - 100j)
    mesh = mesh_of(Case(a, a, np.arange(n, dtype=np.int32), AT_REST))
    check_triangulation(mesh)
    assert mesh.vertices == FRAME + n
    assert predicted_by(mesh, n) == pytest.approx(a, abs=1e-6)
    assert measured_by(mesh, n).weight_agreement == pytest.approx(1.0)


@given(seeds, st.floats(-14, -2), st.sampled_from(["line", "pixels", "circle", "twice"]))
@settings(max_examples=200 if COMPILED else 20)
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


def test_no_vertex_is_lost_where_pairs_nearly_coincide_on_a_circle():
    """Rounding then puts a new minutia into the circles of all triangles of an earlier one."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        z = 100 * np.exp(1j * np.pi / 18 * rng.integers(0, 12, 12))
        noise = rng.normal(0, 1e-8, (2, 12))
        a = np.vstack([z.real + noise[0], z.imag + noise[1], np.ones(12), np.zeros(12)])
        check_whole(mesh_of(Case(a, a, np.arange(12, dtype=np.int32), AT_REST)))


def test_no_minutiae_make_the_frame_alone():
    nothing = np.empty((4, 0))
    case = Case(nothing, nothing, np.empty(0, np.int32), AT_REST)
    for room in (0, 2):
        mesh = mesh_of(case, room=room)
        assert (mesh.vertices, mesh.triangles) == (FRAME, FRAME - 2)
        assert np.isfinite(np.array(mesh.ax)[:FRAME]).all()
        assert (mesh.places, mesh.turned, mesh.mean_strain()) == (0, 0, 0)


@pytest.mark.skipif(not COMPILED, reason="minutes where kernels are interpreted")
def test_a_mesh_is_filled_to_its_last_place():
    n = 2000
    a = np.vstack([np.random.default_rng(1).uniform(0, 2000, (2, n)), np.ones(n), np.zeros(n)])
    case = Case(a, moved(a, 1.0), np.arange(n, dtype=np.int32), transform_of(1.0, 0j))
    mesh = mesh_of(case, room=0)
    assert mesh.vertices == n + FRAME == mesh.capacity
    assert sorted_corners(triangles_of(mesh)) == triangulated(vertices_of(mesh)[0])
    assert predicted_by(mesh, n) == pytest.approx(case.b, abs=1e-5)


@given(seeds)
def test_measuring_changes_no_prediction(seed):
    case = some_case(seed)
    n = case.a.shape[1]
    mesh, other = mesh_of(case), kernel.PairMesh(P, n)
    fill(other, case, measured=False)
    assert predicted_by(mesh, n).tolist() == predicted_by(other, n).tolist()
    assert (other.places, other.edges) == (0, 0)


@given(seeds, st.booleans())
@settings(max_examples=20)
def test_used_fresh_and_interpreted_meshes_agree_to_the_last_bit(plain, seed, crowded):
    case = some_case(seed, 15)
    n = case.a.shape[1]
    if crowded:
        a, b = (on_pixels(np.random.default_rng(seed + k), n) for k in range(2))
        case = Case(a, b, case.partner, case.transform)
    used = kernel.PairMesh(P, 2 * MOST)
    for one in (some_case(seed + 1), some_case(seed + 2), case):
        fill(used, one)
    fresh, interpreted = mesh_of(case, room=0), mesh_of(case, plain.pair_mesh)
    assert shown(used, n) == shown(fresh, n) == shown(interpreted, n)

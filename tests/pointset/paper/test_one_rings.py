import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, as_move, crowded_pixels, moved, seeds, worn

from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.frames import UnitFrame
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper import _one_ring_kernel
from fpmatch.pointset.paper.matcher import best_overlay, fit_rings, similar_rings
from fpmatch.pointset.paper.one_rings import map_to_unit_circle, prepare_points
from fpmatch.pointset.paper.parametrize import parametrize

even_points = seeds.map(lambda seed: np.random.default_rng(seed).uniform(0, 400, (30, 2)))


@given(even_points | crowded_pixels)
def test_all_rings_at_once_are_the_rings_one_by_one(points):
    mesh = triangulate(points)
    rings = map_to_unit_circle(mesh)
    assert sorted(rings.centre.tolist()) == mesh.interior.nonzero()[0].tolist()
    for i, centre in enumerate(rings.centre):
        entry = slice(rings.start[i], rings.start[i + 1])
        assert rings.vertex[entry].tolist() == mesh.one_ring(centre).tolist()
        expected = parametrize(mesh.points[mesh.one_ring(centre)], mesh.points[centre])
        boundary = rings.circle[:, entry].T
        assert boundary == pytest.approx(expected.boundary, abs=1e-12)
        assert rings.weight[entry] == pytest.approx(expected.weights, abs=1e-9)
        assert rings.image[:, i] == pytest.approx(expected.image, abs=1e-9)
        assert rings.area[i] == pytest.approx(expected.area, abs=1e-12)


@given(any_finite_points)
def test_every_finite_set_has_finite_rings(points):
    rings = map_to_unit_circle(triangulate(UnitFrame.of(points).apply(points)))
    assert np.isfinite(rings.circle).all()
    assert (np.hypot(*rings.image) <= 1).all()
    assert ((rings.area > 0) & (rings.area < np.pi)).all()


def two_views(seed, crowd=0):
    """Return a set, a worn copy of it, and the moves of their similar rings.

    The first `crowd` points lie close together.
    """
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 1, (30, 2))
    points[:crowd] = 0.4 + points[:crowd] / 50
    move = Similarity(rng.uniform(0.5, 2), rng.uniform(-3, 3), *rng.uniform(-90, 90, 2))
    p, q = prepare_points(points), prepare_points(worn(points, move, seed, 0.05, 0.1)[0])
    return p, q, fit_rings(p, q, similar_rings(p.rings, q.rings, 0.3))


def fit_with_numpy(p, q, ring_p, ring_q):
    """Return the move of one pair of rings from the definition, every cyclic shift tried."""
    corners, circles, images = [], [], []
    for each, ring in ((p.rings, ring_p), (q.rings, ring_q)):
        entry = slice(*each.start[ring : ring + 2])
        corners.append(each.vertex[entry])
        circles.append(np.array([1, 1j]) @ each.circle[:, entry])
        images.append(np.array([1, 1j]) @ each.image[:, ring])
    degree = len(corners[0])
    strength = [
        abs(np.vdot(circles[0], np.roll(circles[1], -shift)) + degree * np.vdot(*images))
        for shift in range(degree)
    ]
    shift = int(np.argmax(strength))
    corners_p = [p.rings.centre[ring_p], *corners[0]]
    corners_q = [q.rings.centre[ring_q], *np.roll(corners[1], -shift)]
    return as_move(Similarity.fit(p.unit.T[corners_p], q.unit.T[corners_q]))


def count_with_numpy(move, p, q, tolerance):
    """Return how many points match under a move, from all distances."""
    distance = np.hypot(*(moved(p.unit, move)[:, :, None] - q.unit[:, None, :]))
    near = distance <= tolerance
    if len(q.grid.axis):  # crowds are split
        near &= distance == distance.min(axis=1, keepdims=True)
    return int(min(near.any(axis=1).sum(), near.any(axis=0).sum()))


def test_a_ring_that_does_not_go_round_its_centre_has_no_image():
    centre, ring = np.array([5.0, 9.0]), np.array([[1.0, 2.0], [9.0, 4.0], [6.0, 20.0]])
    beside, clockwise, at_vertex = ring + 200, ring[::-1], ring - ring[2] + centre
    xy = np.ascontiguousarray(np.vstack([[centre] * 4, beside, ring, clockwise, at_vertex]).T)
    own, start, vertex = (np.arange(*of, dtype=np.int32) for of in ((4,), (0, 13, 3), (4, 16)))
    boundary = np.ascontiguousarray(xy[:, vertex])  # and not on the unit circle
    image = np.empty((2, 4))
    _one_ring_kernel.centre_images(xy, own, start, vertex, boundary, np.empty(12), image)
    assert image[:, [0, 2, 3]].tolist() == [[2.0, 2.0, 2.0], [0.0, 0.0, 0.0]]
    assert image[:, 1] == pytest.approx(centre)


@given(seeds)
def test_fit_agrees_with_its_twin(seed):
    p, q, moves = two_views(seed)
    alike = similar_rings(p.rings, q.rings, 0.3)
    for move, (ring_p, ring_q) in zip(moves, alike, strict=True):
        assert move == pytest.approx(fit_with_numpy(p, q, ring_p, ring_q), abs=1e-9)


@given(seeds, st.sampled_from([0, 25]), st.sampled_from([0.3, 1.5]))
def test_overlay_finds_the_best_move_or_the_first_that_is_good_enough(seed, crowd, precision):
    p, q, moves = two_views(seed, crowd)
    tolerance, enough = precision * q.spacing, len(p) // 3
    counts = np.array([count_with_numpy(move, p, q, tolerance) for move in moves])
    best = best_overlay(p, q, moves, tolerance, len(p))
    assert best == ((counts.argmax(), counts.max()) if counts.any() else None)
    good = np.flatnonzero(counts >= enough)
    if len(good):
        assert best_overlay(p, q, moves, tolerance, enough) == (good[0], counts[good[0]])


def test_points_moved_onto_one_point_count_once():
    p, q, moves = two_views(5)
    collapse = np.array([[1e-6, 0.0, *q.unit[:, 3]]])
    genuine = best_overlay(p, q, moves, 0.03, len(p))
    best = best_overlay(p, q, np.vstack([collapse, moves]), 0.03, len(p))
    assert best == (genuine[0] + 1, genuine[1])

"""The kernel against slow, obvious numpy twins, and compiled against interpreted."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from pointset_strategies import seeds

from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.unit_circle import _one_ring_kernel, matcher, one_rings
from fpmatch.pointset.unit_circle.matcher import (
    best_overlay,
    fit_rings,
    match_by_unit_circle,
    similar_rings,
)
from fpmatch.pointset.unit_circle.parametrize import shape_preserving_weights
from fpmatch.pointset.unit_circle.prepared_points import PreparedPoints, prepare_points


def two_views(seed: int, n: int = 30) -> tuple[PreparedPoints, PreparedPoints]:
    """Return a set, and a moved, jittered and partly replaced copy of it."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 100, (n, 2))
    move = Similarity(rng.uniform(0.5, 2), rng.uniform(-3, 3), *rng.uniform(-90, 90, 2))
    q = move.apply(p + rng.normal(0, 1, p.shape))
    gone = rng.random(n) < 0.1
    q[gone] = rng.uniform(q.min(axis=0), q.max(axis=0), (int(gone.sum()), 2))
    return prepare_points(p), prepare_points(rng.permutation(q))


def fit_with_numpy(p: PreparedPoints, q: PreparedPoints, ring_p: int, ring_q: int) -> np.ndarray:
    """Return the move of one pair of rings from the definition, every cyclic shift tried."""
    entry_p = slice(*p.rings.start[ring_p : ring_p + 2])
    entry_q = slice(*q.rings.start[ring_q : ring_q + 2])
    degree = entry_p.stop - entry_p.start
    circle_p, circle_q = (
        np.array([1, 1j]) @ rings.circle[:, entry]
        for rings, entry in ((p.rings, entry_p), (q.rings, entry_q))
    )
    image_p = np.array([1, 1j]) @ p.rings.image[:, ring_p]
    image_q = np.array([1, 1j]) @ q.rings.image[:, ring_q]
    strength = [
        abs(np.vdot(circle_p, np.roll(circle_q, -shift)) + degree * np.conjugate(image_p) * image_q)
        for shift in range(degree)
    ]
    shift = int(np.argmax(strength))
    corners_p = [p.rings.centre[ring_p], *p.rings.vertex[entry_p]]
    corners_q = [q.rings.centre[ring_q], *np.roll(q.rings.vertex[entry_q], -shift)]
    fit = Similarity.fit(p.unit.T[corners_p], q.unit.T[corners_q])
    return np.array([*fit.matrix[:, 0], fit.tx, fit.ty])


def count_with_numpy(
    move: np.ndarray, p: PreparedPoints, q: PreparedPoints, tolerance: float
) -> int:
    """Return how many points match under a move, from all distances."""
    a, b, tx, ty = move
    moved = np.array([[a, -b], [b, a]]) @ p.unit + [[tx], [ty]]
    near = np.hypot(*(moved[:, :, None] - q.unit[:, None, :])) <= tolerance
    return int(min(near.any(axis=1).sum(), near.any(axis=0).sum()))


def star(rng: np.random.Generator, degree: int, centre: np.ndarray) -> np.ndarray:
    """Return a ring (degree, 2) round a centre, counter-clockwise, no side seen from behind."""
    angle = np.sort(np.arange(degree) + rng.uniform(-0.2, 0.2, degree)) * 2 * np.pi / degree
    radius = rng.uniform(10, 60, degree)
    return centre + np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def centred(rings: list[np.ndarray], centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return weights and images of centres, rings one after the other, that stay where they are."""
    xy = np.ascontiguousarray(np.vstack([centres, *rings]).T)
    start = np.cumsum([0, *map(len, rings)]).astype(np.int32)
    vertex = np.arange(len(centres), xy.shape[1], dtype=np.int32)
    centre = np.arange(len(centres), dtype=np.int32)
    boundary = np.ascontiguousarray(xy[:, vertex])  # and not on the unit circle
    weight, image = np.empty(len(vertex)), np.empty((2, len(centres)))
    _one_ring_kernel.centre_images(xy, centre, start, vertex, boundary, weight, image)
    return weight, image


@given(seeds)
def test_weights_agree_with_their_twin_wherever_a_ring_begins(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centres = rng.uniform(100, 300, (4, 2))
    rings = [star(rng, int(rng.integers(4, 9)), centre) for centre in centres]
    weight, image = centred(rings, centres)
    assert image == pytest.approx(centres.T)
    expected = [
        shape_preserving_weights(ring, centre) for ring, centre in zip(rings, centres, strict=True)
    ]
    assert weight == pytest.approx(np.concatenate(expected), abs=1e-9)
    turned = [np.roll(ring, 1, axis=0) for ring in rings]
    rolled = [np.roll(share, 1) for share in expected]
    assert centred(turned, centres)[0] == pytest.approx(np.concatenate(rolled), abs=1e-9)


def test_a_ring_that_does_not_go_round_its_centre_has_no_image(rng: np.random.Generator) -> None:
    centre = np.array([5.0, 9.0])
    ring = star(rng, 6, centre)
    beside, clockwise, at_vertex = ring + 200, ring[::-1], ring - ring[2] + centre
    _, image = centred([beside, ring, clockwise, at_vertex], np.tile(centre, (4, 1)))
    assert image[0, [0, 2, 3]].tolist() == [2.0, 2.0, 2.0]
    assert image[1, [0, 2, 3]].tolist() == [0.0, 0.0, 0.0]
    assert image[:, 1] == pytest.approx(centre)


@given(seeds)
@settings(max_examples=10)
def test_weights_of_any_place_in_a_ring_give_the_place_back(
    interpreted_kernel: ModuleType, seed: int
) -> None:
    """The place need not be one of the points, where another kernel asks."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 100, 2)
    points = np.ascontiguousarray(star(rng, 7, np.array([x, y])).T)
    weight = np.full(9, np.nan)
    vertex = np.array([0, 0, *range(7)], np.int32)
    assert interpreted_kernel.shape_preserving_weights(*points, vertex, 2, 9, x, y, weight)
    assert np.isnan(weight[:2]).all()
    assert weight[2:].sum() == pytest.approx(1.0)
    assert points @ weight[2:] == pytest.approx([x, y])


@given(seeds)
def test_fit_agrees_with_its_twin(seed: int) -> None:
    p, q = two_views(seed)
    alike = similar_rings(p.rings, q.rings, 0.3)
    moves = fit_rings(p, q, alike)
    for move, (ring_p, ring_q) in zip(moves, alike, strict=True):
        assert move == pytest.approx(fit_with_numpy(p, q, ring_p, ring_q), abs=1e-9)


@given(seeds)
def test_overlay_agrees_with_its_twin(seed: int) -> None:
    p, q = two_views(seed)
    moves = fit_rings(p, q, similar_rings(p.rings, q.rings, 0.3))
    tolerance = 0.3 * q.spacing
    counts = [count_with_numpy(move, p, q, tolerance) for move in moves]
    best = best_overlay(p, q, moves, tolerance, len(p))
    assert best == ((int(np.argmax(counts)), max(counts)) if any(counts) else None)


@given(seeds)
def test_overlay_ends_at_the_first_move_that_is_good_enough(seed: int) -> None:
    p, q = two_views(seed)
    moves = fit_rings(p, q, similar_rings(p.rings, q.rings, 0.3))
    counts = np.array([count_with_numpy(move, p, q, 0.03) for move in moves])
    enough = len(p) // 3
    good = np.flatnonzero(counts >= enough)
    best = best_overlay(p, q, moves, 0.03, enough)
    if len(good):
        assert best == (good[0], counts[good[0]])


def test_points_moved_onto_one_point_count_once() -> None:
    p, q = two_views(5)
    moves = fit_rings(p, q, similar_rings(p.rings, q.rings, 0.3))
    collapse = np.array([[1e-6, 0.0, *q.unit[:, 3]]])
    genuine = best_overlay(p, q, moves, 0.03, len(p))
    best = best_overlay(p, q, np.vstack([collapse, moves]), 0.03, len(p))
    assert genuine is not None
    assert best == (genuine[0] + 1, genuine[1])


@given(seeds)
@settings(max_examples=10)
def test_compiled_and_interpreted_agree_to_the_last_bit(
    interpreted_kernel: ModuleType, seed: int
) -> None:
    results = []
    for kernel in (_one_ring_kernel, interpreted_kernel):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(one_rings, "kernel", kernel)
            patch.setattr(matcher, "kernel", kernel)
            p, q = two_views(seed, 16)
            match = match_by_unit_circle(p.points, q.points)
            results.append((p.rings, match))
    (rings, match), (same_rings, same_match) = results
    for name in ("centre", "vertex", "weight", "image", "area"):
        assert getattr(rings, name).tolist() == getattr(same_rings, name).tolist()
    assert match.transform == same_match.transform
    assert match.pairs.tolist() == same_match.pairs.tolist()

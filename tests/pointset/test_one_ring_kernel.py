"""The kernel against slow, obvious numpy twins, and compiled against interpreted."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from pointset_strategies import seeds

from fpmatch.pointset import _one_ring_kernel, one_rings, unit_circle_matcher
from fpmatch.pointset.prepared_points import PreparedPoints, prepare_points
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.unit_circle_matcher import (
    best_overlay,
    fit_rings,
    match_by_unit_circle,
    rings_alike,
)


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


@given(seeds)
def test_fit_agrees_with_its_twin(seed: int) -> None:
    p, q = two_views(seed)
    alike = rings_alike(p.rings, q.rings, 0.3)
    moves = fit_rings(p, q, alike)
    for move, (ring_p, ring_q) in zip(moves, alike, strict=True):
        assert move == pytest.approx(fit_with_numpy(p, q, ring_p, ring_q), abs=1e-9)


@given(seeds)
def test_overlay_agrees_with_its_twin(seed: int) -> None:
    p, q = two_views(seed)
    moves = fit_rings(p, q, rings_alike(p.rings, q.rings, 0.3))
    tolerance = 0.3 * q.spacing
    counts = [count_with_numpy(move, p, q, tolerance) for move in moves]
    best = best_overlay(p, q, moves, tolerance, 1.0)
    if not any(counts):
        assert best is None
    else:
        assert best is not None
        assert best.tolist() == moves[int(np.argmax(counts))].tolist()


@given(seeds)
def test_overlay_ends_at_the_first_move_that_is_good_enough(seed: int) -> None:
    p, q = two_views(seed)
    moves = fit_rings(p, q, rings_alike(p.rings, q.rings, 0.3))
    counts = np.array([count_with_numpy(move, p, q, 0.03) for move in moves])
    enough = np.flatnonzero(counts >= 0.3 * len(p))
    best = best_overlay(p, q, moves, 0.03, 0.3)
    if len(enough):
        assert best is not None
        assert best.tolist() == moves[enough[0]].tolist()


def test_points_moved_onto_one_point_count_once() -> None:
    p, q = two_views(5)
    moves = fit_rings(p, q, rings_alike(p.rings, q.rings, 0.3))
    collapse = np.array([[1e-6, 0.0, *q.unit[:, 3]]])
    genuine = best_overlay(p, q, moves, 0.03, 1.0)
    best = best_overlay(p, q, np.vstack([collapse, moves]), 0.03, 1.0)
    assert genuine is not None
    assert best is not None
    assert best.tolist() == genuine.tolist()


@given(seeds)
@settings(max_examples=10)
def test_compiled_and_interpreted_agree_to_the_last_bit(
    interpreted_kernel: ModuleType, seed: int
) -> None:
    results = []
    for kernel in (_one_ring_kernel, interpreted_kernel):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(one_rings, "kernel", kernel)
            patch.setattr(unit_circle_matcher, "kernel", kernel)
            p, q = two_views(seed, 16)
            match = match_by_unit_circle(p.points, q.points)
            results.append((p.rings, match))
    (rings, match), (same_rings, same_match) = results
    for name in ("centre", "vertex", "weight", "image", "area"):
        assert getattr(rings, name).tolist() == getattr(same_rings, name).tolist()
    assert match.transform == same_match.transform
    assert match.pairs.tolist() == same_match.pairs.tolist()

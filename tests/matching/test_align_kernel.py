"""The alignment kernel against slow, obvious numpy twins, and compiled against interpreted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import Points, any_points, jittered, moved, on_pixels, seeds, spread_points
from numpy.typing import NDArray

from fpmatch.matching import _align_kernel
from fpmatch.pointset.similarity import Similarity

DIRECTION_ARM_PX = 30.0  # directions weigh as positions do at this distance from the middle
SCALE_LIMITS = (0.94, 1.06)
FEWEST_FOR_SCALE = 4
STILLNESS = 0.3  # of this weight is the belief that the skin has not bent
MIN_COSINE = 0.85

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True)
class Reach:
    """How far partners may lie: beside a pair, its growth with distance, and its limit (px)."""

    near: float
    spread: float
    far: float


def plane(points: Points) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return positions and directions of minutiae as complex numbers."""
    return points[0] + 1j * points[1], points[2] + 1j * points[3]


def move_twin(points: Points, transform: Floats) -> Points:
    z, d = plane(points)
    linear, shift = transform[0] + 1j * transform[1], transform[2] + 1j * transform[3]
    z, d = shift + linear * z, linear / abs(linear) * d
    return np.array([z.real, z.imag, d.real, d.imag])


def pair_twin(moved_a: Points, b: Points, reach: Floats, min_cosine: float) -> tuple[Ints, Floats]:
    """Return partners and weights: the largest of its row and of its column, where not 0.

    The first of equals; written in the order of the kernel's own sums, so that equal stays equal.
    """
    n, m = moved_a.shape[1], b.shape[1]
    partner, weight = np.full(n, -1, np.int32), np.zeros(n)
    if not n or not m:
        return partner, weight
    x, y, c, s = moved_a[:, :, None]
    squared = (b[0] - x) ** 2 + (b[1] - y) ** 2
    cosine = c * b[2] + s * b[3]
    within = reach[:, None] * reach[:, None]
    value = (1 - 0.5 * squared / within) * (cosine - min_cosine) * (1 / (1 - min_cosine))
    value[(squared >= within) | (cosine <= min_cosine)] = 0
    best, rival = value.argmax(axis=1), value.argmax(axis=0)
    for i in range(n):
        if value[i, best[i]] > 0 and rival[best[i]] == i:
            partner[i], weight[i] = best[i], value[i, best[i]]
    return partner, weight


def fit_twin(a: Points, b: Points, partner: Ints, weight: Floats, transform: Floats) -> Floats:
    """Return the transform that fits the pairs best by weighted least squares."""
    i = np.flatnonzero(partner >= 0)
    if len(i) < 2:
        return transform
    w = weight[i] / weight[i].sum()
    (z, d), (z_b, d_b) = (plane(side) for side in (a[:, i], b[:, partner[i]]))
    middle, middle_b = w @ z, w @ z_b
    positions = np.sum(w * (z - middle).conj() * (z_b - middle_b))
    spread = np.sum(w * abs(z - middle) ** 2)
    scale = abs(positions) / spread if spread > 0 and len(i) >= FEWEST_FOR_SCALE else 1.0
    turn = positions + DIRECTION_ARM_PX**2 * np.sum(w * d.conj() * d_b)
    linear = np.clip(scale, *SCALE_LIMITS) * turn / abs(turn)
    shift = middle_b - linear * middle
    return np.array([linear.real, linear.imag, shift.real, shift.imag])


def seed_twin(a: Points, b: Points, seed: Ints, reach: Reach) -> tuple[Floats, float]:
    """Return the transform that a seed leads to, and the weight of the pairs it led through."""
    (z, d), (z_b, d_b) = plane(a), plane(b)
    i, j = seed
    linear = d_b[j] * d[i].conj()
    shift = z_b[j] - linear * z[i]
    transform = np.array([linear.real, linear.imag, shift.real, shift.imag])
    within = np.minimum(reach.near + reach.spread * abs(z - z[i]), reach.far)
    partner, weight = pair_twin(move_twin(a, transform), b, within, MIN_COSINE)
    return fit_twin(a, b, partner, weight, transform), weight.sum()


def bend_twin(
    moved_a: Points, b: Points, partner: Ints, weight: Floats, sigma: float, reach: Reach
) -> tuple[Points, Floats]:
    """Return the minutiae displaced by the mean of the other pairs' residuals, and their reach."""
    z, d = plane(moved_a)
    paired = np.flatnonzero(partner >= 0)
    residual = plane(b)[0][partner[paired]] - z[paired]
    bent, within = z.copy(), np.full(len(z), float(reach.far))
    for i in range(len(z)):
        other = paired != i
        distance = abs(z[paired[other]] - z[i])
        mass = weight[paired[other]] * np.exp(-(distance**2) / (2 * sigma**2))
        bent[i] += (mass * residual[other]).sum() / (STILLNESS + mass.sum())
        if len(distance):
            within[i] = min(reach.near + reach.spread * distance.min(), reach.far)
    return np.array([bent.real, bent.imag, d.real, d.imag]), within


@dataclass
class Scratch:
    """The arrays that the kernel writes to."""

    moved: Points
    bent: Points
    reach: Floats
    partner: Ints
    weight: Floats
    rival: Ints
    rival_weight: Floats

    @classmethod
    def like(cls, a: Points, b: Points) -> Scratch:
        n, m = a.shape[1], b.shape[1]
        return cls(
            *(np.full((4, n), np.nan) for _ in range(2)),
            np.full(n, np.nan),
            np.full(n, 99, np.int32),
            np.full(n, np.nan),
            np.full(m, 99, np.int32),
            np.full(m, np.nan),
        )

    @property
    def pairing(self) -> tuple[Ints, Floats, Ints, Floats]:
        return self.partner, self.weight, self.rival, self.rival_weight


def two_impressions(seed: int, n: int = 14) -> tuple[Points, Points]:
    """Return a print and a moved, jittered, partly replaced copy of it in another order."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, n)
    b = jittered(rng, moved(a, rng.uniform(-3, 3), complex(*rng.uniform(-90, 90, 2))), 2, 0.1)
    gone = int(rng.integers(0, 5))
    b = np.hstack([b[:, gone:], moved(spread_points(rng, gone), 1.0)])
    return a, np.ascontiguousarray(b[:, rng.permutation(b.shape[1])])


def some_pairs(rng: np.random.Generator, n: int, m: int) -> tuple[Ints, Floats]:
    """Return random partners, one to one, and weights."""
    partner = np.full(n, -1, np.int32)
    paired = int(rng.integers(0, min(n, m) + 1))
    partner[rng.permutation(n)[:paired]] = rng.permutation(m)[:paired]
    return partner, np.where(partner >= 0, rng.uniform(0.01, 1, n), 0.0)


def some_transform(rng: np.random.Generator) -> Floats:
    scale, turn = rng.uniform(0.9, 1.1), rng.uniform(-4, 4)
    return np.array([scale * np.cos(turn), scale * np.sin(turn), *rng.uniform(-200, 200, 2)])


@given(seeds)
def test_move_agrees_with_its_twin(seed: int) -> None:
    points, transform = any_points(seed), some_transform(np.random.default_rng(seed))
    found = np.empty_like(points)
    _align_kernel.move(points, transform, found)
    assert found == pytest.approx(move_twin(points, transform), abs=1e-9)
    assert np.hypot(found[2], found[3]) == pytest.approx(1.0)


@given(seeds, st.floats(1, 40), st.floats(-0.5, 0.95))
def test_pairs_agree_with_their_twin(seed: int, within: float, min_cosine: float) -> None:
    a, b = any_points(seed), any_points(seed + 1)
    reach = np.random.default_rng(seed).uniform(0.5, 1, a.shape[1]) * within
    s = Scratch.like(a, b)
    total = _align_kernel.pair(a, b, reach, min_cosine, *s.pairing)
    partner, weight = pair_twin(a, b, reach, min_cosine)
    assert s.partner.tolist() == partner.tolist()
    assert s.weight.tolist() == weight.tolist()
    assert total == pytest.approx(weight.sum())


@given(seeds)
def test_pairs_are_one_to_one_within_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = on_pixels(rng, 20), on_pixels(rng, 15)
    s = Scratch.like(a, b)
    _align_kernel.pair(a, b, np.full(20, 10.0), MIN_COSINE, *s.pairing)
    i = np.flatnonzero(s.partner >= 0)
    j = s.partner[i]
    assert len(set(j.tolist())) == len(j)
    assert (np.hypot(*(a[:2, i] - b[:2, j])) < 10).all()
    assert ((a[2:, i] * b[2:, j]).sum(axis=0) > MIN_COSINE).all()
    assert (s.weight[i] > 0).all()
    assert (s.weight[i] <= 1 + 1e-12).all()
    assert not s.weight[s.partner < 0].any()
    assert (s.partner[s.partner < 0] == -1).all()


@given(seeds)
def test_fit_agrees_with_its_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = two_impressions(seed)
    partner, weight = some_pairs(rng, a.shape[1], b.shape[1])
    start = some_transform(rng)
    found = start.copy()
    assert _align_kernel.fit(a, b, partner, weight, found) == np.count_nonzero(partner >= 0)
    assert found == pytest.approx(fit_twin(a, b, partner, weight, start), abs=1e-8)


@given(seeds, st.floats(*SCALE_LIMITS))
def test_fit_returns_the_transform_that_was_applied(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    a = spread_points(rng, 12)
    turn, shift = rng.uniform(-np.pi, np.pi), complex(*rng.uniform(-99, 99, 2))
    b = moved(a, turn, shift, scale)
    found = np.empty(4)
    _align_kernel.fit(a, b, np.arange(12, dtype=np.int32), rng.uniform(0.1, 1, 12), found)
    assert found[0] + 1j * found[1] == pytest.approx(scale * np.exp(1j * turn), abs=1e-9)
    assert found[2] + 1j * found[3] == pytest.approx(shift, abs=1e-6)


def test_fit_by_positions_alone_is_the_point_sets_own() -> None:
    """Directions that agree with the rotation pull nowhere, so both fits are the same."""
    rng = np.random.default_rng(2)
    a = spread_points(rng, 12)
    b = moved(a, 0.4, 5 + 9j, 1.02)
    weight = rng.uniform(0.1, 1, 12)
    found = np.empty(4)
    _align_kernel.fit(a, b, np.arange(12, dtype=np.int32), weight, found)
    plain = Similarity.fit(a[:2].T, b[:2].T, weight)
    assert found == pytest.approx([*plain.matrix[:, 0], plain.tx, plain.ty])


@pytest.mark.parametrize("paired", [0, 1])
def test_fewer_than_two_pairs_leave_the_transform_as_it_is(paired: int) -> None:
    a, b = two_impressions(3)
    partner = np.full(14, -1, np.int32)
    partner[:paired] = 4
    found = np.array([0.6, 0.8, -3.0, 5.0])
    assert _align_kernel.fit(a, b, partner, np.ones(14), found) == paired
    assert found.tolist() == [0.6, 0.8, -3.0, 5.0]


def test_pairs_on_one_spot_turn_by_their_directions() -> None:
    a = np.zeros((4, 3))
    a[2] = 1
    b = moved(a, 0.5, 20 + 10j)
    found = np.empty(4)
    _align_kernel.fit(a, b, np.arange(3, dtype=np.int32), np.ones(3), found)
    assert found == pytest.approx([np.cos(0.5), np.sin(0.5), 20, 10])


@given(seeds)
def test_seeds_agree_with_their_twin(seed: int) -> None:
    a, b = two_impressions(seed)
    rng = np.random.default_rng(seed)
    chosen = np.column_stack([rng.integers(0, 14, 5), rng.integers(0, 14, 5)]).astype(np.int32)
    reach = Reach(9.0, 0.08, 22.0)
    s = Scratch.like(a, b)
    transforms, support = np.empty((5, 4)), np.empty(5)
    _align_kernel.support_of_seeds(
        a, b, chosen, reach.near, reach.spread, reach.far, MIN_COSINE, transforms, support,
        s.moved, s.reach, *s.pairing,
    )  # fmt: skip
    for k in range(5):
        transform, weight = seed_twin(a, b, chosen[k], reach)
        assert support[k] == pytest.approx(weight, abs=1e-9)
        assert transforms[k] == pytest.approx(transform, abs=1e-6)


def refined(
    kernel: ModuleType, a: Points, b: Points, start: Floats, bend_rounds: int
) -> tuple[float, Floats, Scratch]:
    s, transform = Scratch.like(a, b), start.copy()
    total = kernel.refine(
        a, b, transform, 2, 16.0, bend_rounds, 45.0, 8.0, 0.08, 18.0, MIN_COSINE,
        s.moved, s.bent, s.reach, *s.pairing,
    )  # fmt: skip
    return total, transform, s


@given(seeds, st.integers(0, 3))
def test_refinement_agrees_with_its_twin(seed: int, bend_rounds: int) -> None:
    a, b = two_impressions(seed)
    first = int(np.random.default_rng(seed).integers(0, 14))
    nearest = np.abs(plane(b)[0] - plane(a)[0][first]).argmin()
    start = seed_twin(a, b, np.array([first, nearest], np.int32), Reach(9, 0.08, 22))[0]
    total, transform, s = refined(_align_kernel, a, b, start, bend_rounds)

    expected = start
    for _ in range(2):
        partner, weight = pair_twin(move_twin(a, expected), b, np.full(14, 16.0), MIN_COSINE)
        expected = fit_twin(a, b, partner, weight, expected)
    moved_a = move_twin(a, expected)
    for _ in range(bend_rounds):
        bent, within = bend_twin(moved_a, b, partner, weight, 45.0, Reach(8, 0.08, 18))
        partner, weight = pair_twin(bent, b, within, MIN_COSINE)
    assert transform == pytest.approx(expected, abs=1e-6)
    assert s.partner.tolist() == partner.tolist()
    assert s.weight == pytest.approx(weight, abs=1e-8)
    assert total == pytest.approx(weight.sum())
    assert s.moved == pytest.approx(moved_a, abs=1e-6)
    if bend_rounds:
        assert s.bent == pytest.approx(bent, abs=1e-6)


@given(seeds)
@settings(max_examples=10)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int
) -> None:
    a, b = two_impressions(seed)
    start = some_transform(np.random.default_rng(seed))
    (total, transform, s), (same_total, same_transform, same) = (
        refined(kernel, a, b, start, 3) for kernel in (_align_kernel, interpreted("_align_kernel"))
    )
    assert s.partner.tolist() == same.partner.tolist()
    assert transform == pytest.approx(same_transform, rel=1e-12)
    assert total == pytest.approx(same_total, rel=1e-12)
    assert s.bent == pytest.approx(same.bent, rel=1e-12)

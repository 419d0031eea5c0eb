"""The alignment kernel against slow, obvious numpy twins, and compiled against interpreted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import Points, any_points, jittered, moved, on_pixels, seeds, spread_points
from numpy.typing import NDArray

from fpmatch.matching import _align_kernel
from fpmatch.matching.align import AlignmentParameters
from fpmatch.pointset.similarity import Similarity

DIRECTION_ARM_PX = 30.0  # directions weigh as positions do at this distance from the middle
SCALE_LIMITS = (0.94, 1.06)
FEWEST_FOR_SCALE = 4
STILLNESS = 0.6
STIFFNESS_PX2 = 800.0
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
    """Return the minutiae displaced as the others are, by a fitted plane, and their reach."""
    z, d = plane(moved_a)
    paired = np.flatnonzero(partner >= 0)
    residual = plane(b)[0][partner[paired]] - z[paired]
    bent, within = z.copy(), np.full(len(z), float(reach.far))
    for i in range(len(z)):
        other = paired != i
        distance = abs(z[paired[other]] - z[i])
        mass = weight[paired[other]] * np.exp(-(distance**2) / (2 * sigma**2))
        beside = z[paired[other]] - z[i]
        plane_of = np.column_stack([np.ones(len(beside)), beside.real, beside.imag])
        prior = np.diag([STILLNESS, STIFFNESS_PX2, STIFFNESS_PX2])
        normal = plane_of.T @ (mass[:, None] * plane_of) + prior
        bent[i] += np.linalg.solve(normal, plane_of.T @ (mass * residual[other]))[0]
        if len(distance):
            within[i] = min(reach.near + reach.spread * distance.min(), reach.far)
    return np.array([bent.real, bent.imag, d.real, d.imag]), within


PARAMETERS = AlignmentParameters(max_turn_deg=math.degrees(math.acos(MIN_COSINE)))


def table_of(
    a: Points,
    b: Points,
    parameters: AlignmentParameters = PARAMETERS,
    module: ModuleType = _align_kernel,
    room: int = 3,
) -> Any:
    """Return a table with A and B on it, and room for more minutiae, which must not matter."""
    table = module.LightTable(a.shape[1] + room, b.shape[1] + room, 5, parameters)
    table.put_a(a, a.shape[1])
    table.put_b(b, b.shape[1])
    return table


def set_transform(table: Any, transform: Floats) -> None:
    table.c, table.s, table.x, table.y = transform.tolist()


def transform_of(table: Any) -> Floats:
    return np.array([table.c, table.s, table.x, table.y])


def pairing_of(table: Any) -> tuple[Ints, Floats]:
    """Return partners and weights."""
    return tuple(np.asarray(side)[: table.size_a] for side in (table.partner, table.weight))


def laid_at(table: Any, row: int) -> Floats:
    """Return two rows of where the minutiae of A lie."""
    return np.asarray(table.laid)[row : row + 2, : table.size_a]


def paired(
    a: Points, b: Points, reach: Floats, min_cosine: float = MIN_COSINE
) -> tuple[float, Ints, Floats]:
    """Return the weight of the pairs of minutiae that lie as they are, partners and weights."""
    widest = max(reach.max(initial=0.0), 1.0)
    turn = math.degrees(math.acos(min_cosine))
    table = table_of(a, b, replace(PARAMETERS, seed_reach_limit_px=widest, max_turn_deg=turn))
    set_transform(table, np.array([1.0, 0.0, 0.0, 0.0]))
    table.move()
    np.asarray(table.reach)[: len(reach)] = reach
    return table.pair(0), *pairing_of(table)


def fitted(
    a: Points, b: Points, partner: Ints, weight: Floats, start: Floats
) -> tuple[int, Floats]:
    """Return the number of pairs and the transform fitted to them."""
    table = table_of(a, b)
    set_transform(table, start)
    for side, given_side in zip(pairing_of(table), (partner, weight), strict=True):
        side[:] = given_side
    paired = np.flatnonzero(partner >= 0)
    np.asarray(table.paired)[: len(paired)] = paired
    table.pairs = len(paired)
    return table.fit(), transform_of(table)


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
    table = table_of(points, points)
    set_transform(table, transform)
    table.move()
    found = np.vstack([laid_at(table, 0), laid_at(table, 2)])
    assert found == pytest.approx(move_twin(points, transform), abs=1e-9)
    assert np.hypot(found[2], found[3]) == pytest.approx(1.0)


@given(seeds, st.floats(1, 40), st.floats(-0.5, 0.95))
def test_pairs_agree_with_their_twin(seed: int, within: float, min_cosine: float) -> None:
    a, b = any_points(seed), any_points(seed + 1)
    reach = np.random.default_rng(seed).uniform(0.5, 1, a.shape[1]) * within
    total, *found = paired(a, b, reach, min_cosine)
    partner, weight = pair_twin(a, b, reach, math.cos(math.acos(min_cosine)))
    assert found[0].tolist() == partner.tolist()
    assert found[1] == pytest.approx(weight, rel=1e-9)
    assert total == pytest.approx(weight.sum())


@given(seeds)
def test_pairs_are_one_to_one_within_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = on_pixels(rng, 20), on_pixels(rng, 15)
    _, partner, weight = paired(a, b, np.full(20, 10.0))
    i = np.flatnonzero(partner >= 0)
    j = partner[i]
    assert len(set(j.tolist())) == len(j)
    assert (np.hypot(*(a[:2, i] - b[:2, j])) < 10).all()
    assert ((a[2:, i] * b[2:, j]).sum(axis=0) > MIN_COSINE).all()
    assert (weight[i] > 0).all()
    assert (weight[i] <= 1 + 1e-12).all()
    assert not weight[partner < 0].any()
    assert (partner[partner < 0] == -1).all()


@given(seeds)
def test_fit_agrees_with_its_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = two_impressions(seed)
    partner, weight = some_pairs(rng, a.shape[1], b.shape[1])
    start = some_transform(rng)
    count, found = fitted(a, b, partner, weight, start)
    assert count == np.count_nonzero(partner >= 0)
    assert found == pytest.approx(fit_twin(a, b, partner, weight, start), abs=1e-8)


@given(seeds, st.floats(*SCALE_LIMITS))
def test_fit_returns_the_transform_that_was_applied(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    a = spread_points(rng, 12)
    turn, shift = rng.uniform(-np.pi, np.pi), complex(*rng.uniform(-99, 99, 2))
    b = moved(a, turn, shift, scale)
    everyone = np.arange(12, dtype=np.int32)
    _, found = fitted(a, b, everyone, rng.uniform(0.1, 1, 12), np.zeros(4))
    assert found[0] + 1j * found[1] == pytest.approx(scale * np.exp(1j * turn), abs=1e-9)
    assert found[2] + 1j * found[3] == pytest.approx(shift, abs=1e-6)


def test_fit_by_positions_alone_is_the_point_sets_own() -> None:
    """Directions that agree with the rotation pull nowhere, so both fits are the same."""
    rng = np.random.default_rng(2)
    a = spread_points(rng, 12)
    b = moved(a, 0.4, 5 + 9j, 1.02)
    weight = rng.uniform(0.1, 1, 12)
    _, found = fitted(a, b, np.arange(12, dtype=np.int32), weight, np.zeros(4))
    plain = Similarity.fit(a[:2].T, b[:2].T, weight)
    assert found == pytest.approx([*plain.matrix[:, 0], plain.tx, plain.ty])


@pytest.mark.parametrize("pairs", [0, 1])
def test_fewer_than_two_pairs_leave_the_transform_as_it_is(pairs: int) -> None:
    a, b = two_impressions(3)
    partner = np.full(14, -1, np.int32)
    partner[:pairs] = 4
    count, found = fitted(a, b, partner, np.ones(14), np.array([0.6, 0.8, -3.0, 5.0]))
    assert count == pairs
    assert found.tolist() == [0.6, 0.8, -3.0, 5.0]


def test_pairs_on_one_spot_turn_by_their_directions() -> None:
    a = np.zeros((4, 3))
    a[2] = 1
    b = moved(a, 0.5, 20 + 10j)
    _, found = fitted(a, b, np.arange(3, dtype=np.int32), np.ones(3), np.zeros(4))
    assert found == pytest.approx([np.cos(0.5), np.sin(0.5), 20, 10])


@given(seeds)
def test_seeds_agree_with_their_twin(seed: int) -> None:
    a, b = two_impressions(seed)
    rng = np.random.default_rng(seed)
    chosen = np.column_stack([rng.integers(0, 14, 5), rng.integers(0, 14, 5)]).astype(np.int32)
    reach = Reach(9.0, 0.08, 22.0)
    table = table_of(a, b)
    table.support_of_seeds(chosen, 0, 5)
    for k in range(5):
        transform, weight = seed_twin(a, b, chosen[k], reach)
        assert table.support[k] == pytest.approx(weight, abs=1e-9)
        assert np.asarray(table.transforms)[k] == pytest.approx(transform, abs=1e-6)


def refined(
    a: Points, b: Points, start: Floats, bend_rounds: int, module: ModuleType = _align_kernel
) -> tuple[float, Any]:
    """Return the weight of the pairs after refining a transform, and the table."""
    table = table_of(a, b, replace(PARAMETERS, bend_rounds=bend_rounds), module)
    set_transform(table, start)
    table.begin()
    return table.finish(), table


@given(seeds, st.integers(0, 3))
def test_refinement_agrees_with_its_twin(seed: int, bend_rounds: int) -> None:
    a, b = two_impressions(seed)
    first = int(np.random.default_rng(seed).integers(0, 14))
    nearest = np.abs(plane(b)[0] - plane(a)[0][first]).argmin()
    start = seed_twin(a, b, np.array([first, nearest], np.int32), Reach(9, 0.08, 22))[0]
    total, table = refined(a, b, start, bend_rounds)

    expected = start
    for _ in range(2):
        partner, weight = pair_twin(move_twin(a, expected), b, np.full(14, 16.0), MIN_COSINE)
        expected = fit_twin(a, b, partner, weight, expected)
    moved_a = move_twin(a, expected)
    for _ in range(bend_rounds):
        bent, within = bend_twin(moved_a, b, partner, weight, 45.0, Reach(8, 0.08, 18))
        partner, weight = pair_twin(bent, b, within, MIN_COSINE)
    found_partner, found_weight = pairing_of(table)
    assert transform_of(table) == pytest.approx(expected, abs=1e-6)
    assert found_partner.tolist() == partner.tolist()
    assert found_weight == pytest.approx(weight, abs=1e-8)
    assert total == pytest.approx(weight.sum())
    assert laid_at(table, 0) == pytest.approx(moved_a[:2], abs=1e-6)
    last = bent if bend_rounds else moved_a
    assert laid_at(table, 4) == pytest.approx(last[:2], abs=1e-6)


@given(seeds)
@settings(max_examples=10)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int
) -> None:
    a, b = two_impressions(seed)
    start = some_transform(np.random.default_rng(seed))
    total, table = refined(a, b, start, 3)
    same_total, same = refined(a, b, start, 3, interpreted("_align_kernel"))
    assert pairing_of(table)[0].tolist() == pairing_of(same)[0].tolist()
    assert transform_of(table) == pytest.approx(transform_of(same), rel=1e-12)
    assert total == pytest.approx(same_total, rel=1e-12)
    assert laid_at(table, 4) == pytest.approx(laid_at(same, 4), rel=1e-12)
    chosen = np.random.default_rng(seed).integers(0, a.shape[1], (5, 2)).astype(np.int32)
    found = table.propose(chosen, 5)
    assert found == same.propose(chosen, 5)
    for k in range(found):
        assert table.take(k) == pytest.approx(same.take(k), rel=1e-12)
        assert table.keep() == same.keep()
        assert np.asarray(table.best_partner).tolist() == same.best_partner.tolist()


@pytest.mark.parametrize("reach", [3.0, 300.0, 1e7])
def test_minutiae_are_found_near_any_place_however_far_they_reach(reach: float) -> None:
    rng = np.random.default_rng(7)
    a, b = (spread_points(rng, 30, 0.0, reach) for _ in range(2))
    b[:, :5] = a[:, :5]
    b[0, :5] += 2.0
    _, partner, weight = paired(a, b, np.full(30, 5.0), -1.0)
    expected = pair_twin(a, b, np.full(30, 5.0), -1.0)
    assert partner.tolist() == expected[0].tolist()
    assert weight == pytest.approx(expected[1])
    assert np.count_nonzero(partner >= 0) >= 5


def test_nothing_pairs_with_nothing() -> None:
    nothing = np.empty((4, 0))
    some = spread_points(np.random.default_rng(1), 4)
    for a, b in ((nothing, some), (some, nothing), (nothing, nothing)):
        total, partner, _ = paired(a, b, np.full(a.shape[1], 9.0))
        assert total == 0.0
        assert (partner == -1).all()

"""The overlay against numpy and scipy, and compiled against interpreted."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import seeds

from fpmatch.pointset._grid_kernel import CellGrid
from fpmatch.pointset._similarity_kernel import fit_partners
from fpmatch.pointset.grid import sort_into_cells
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.triangles import _overlay_kernel as kernel

REACHES = 8  # of the kernel: t, t/2, t/4 and so on
STAY = Similarity()


def as_move(transform: Similarity) -> np.ndarray:
    return np.array([*transform.matrix[:, 0], transform.tx, transform.ty])


def grid_of(q: np.ndarray, margin: float = 1.0) -> CellGrid:
    low, high = q.min(axis=1) - margin, q.max(axis=1) + margin
    return sort_into_cells(q, 0.5, low=tuple(low), high=tuple(high))


def loose_lattice(seed: int, side: int = 5) -> np.ndarray:
    """Return points no two of which are nearer than 0.7, shape (2, side²)."""
    rng = np.random.default_rng(seed)
    lattice = np.argwhere(np.ones((side, side))).T.astype(float)
    return lattice + rng.uniform(-0.15, 0.15, lattice.shape)


class Overlay:
    """The arguments of `refine` and its results."""

    def __init__(self, p: np.ndarray, q: np.ndarray, start: Similarity, margin: float = 1.0):
        self.p, self.grid, self.move = p, grid_of(q, margin), as_move(start)
        self.owner = np.empty(q.shape[1], np.int32)
        self.partner = np.empty(p.shape[1], np.int32)
        self.distance2 = np.full(p.shape[1], np.nan)

    def refine(self, t: float, rounds: int = 12, either: ModuleType = kernel) -> int:
        arrays = (self.owner, self.partner, self.distance2, self.move)
        return int(either.refine(self.p, self.grid, t * t, rounds, *arrays))

    def partners(self) -> list[int]:
        """Return the partner of each point as it was given, -1 for none."""
        return [self.grid.order[at] if at >= 0 else -1 for at in self.partner.tolist()]


@given(seeds)
def test_a_perturbed_move_is_refined_to_the_true_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, order = loose_lattice(seed), rng.permutation(25)
    truth = Similarity(rng.uniform(0.9, 1.1), rng.uniform(-3, 3), *rng.uniform(-9, 9, 2))
    q = np.array(truth.apply(p.T[order]).T, order="C")
    nudge = Similarity(
        rng.uniform(0.99, 1.01), rng.uniform(-0.01, 0.01), *rng.uniform(-0.1, 0.1, 2)
    )
    overlay = Overlay(p, q, truth.after(nudge))
    assert overlay.refine(0.25) == 25
    assert overlay.move == pytest.approx(as_move(truth), abs=1e-9)
    assert overlay.partners() == order.argsort().tolist()
    assert overlay.distance2 == pytest.approx(np.zeros(25), abs=1e-15)
    assert overlay.owner[overlay.partner].tolist() == list(range(25))


@pytest.mark.parametrize(("shift", "inside", "paired"), [(0.27, 25, 25), (0.29, -1, 0)])
def test_the_first_round_reaches_twice_as_far_in_area(
    shift: float, inside: int, paired: int
) -> None:
    p = loose_lattice(1)
    overlay = Overlay(p, p.copy(), Similarity(tx=shift))
    assert overlay.refine(0.2) == inside
    assert np.count_nonzero(overlay.partner >= 0) == paired


@given(seeds)
def test_pairs_are_nearest_mutual_and_within_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 4, (2, 20))
    q = np.hstack([p[:, :14] + rng.normal(0, 0.05, (2, 14)), rng.uniform(0, 4, (2, 6))])
    overlay = Overlay(p, q, STAY, margin=4.0)  # all of P lies in the grid
    one_round = Overlay(p, q, STAY, margin=4.0)
    assert one_round.refine(0.3, rounds=1) == 20
    assert overlay.refine(0.3) > 0  # refitted, it may move points outside the grid
    for each, reach2 in ((overlay, 0.09), (one_round, 0.18)):
        paired = np.flatnonzero(each.partner >= 0)
        assert each.owner[each.partner[paired]].tolist() == paired.tolist()
        assert np.count_nonzero(each.owner >= 0) == len(paired)
        assert (each.distance2[paired] < reach2).all()
    points = np.array([one_round.grid.x, one_round.grid.y])
    squared = ((p[:, :, None] - points[:, None, :]) ** 2).sum(axis=0)
    for i in range(20):
        at, nearest = int(one_round.partner[i]), int(squared[i].argmin())
        if at >= 0:
            assert at == nearest
            assert one_round.distance2[i] == squared[i, at]
            assert squared[i, at] == squared[squared.argmin(axis=1) == at, at].min()
        else:
            taken = one_round.owner[nearest] >= 0
            assert squared[i, nearest] >= 0.18 or taken


def test_of_two_points_at_one_the_nearer_has_it() -> None:
    q = np.array([[0.0, 5.0, 0.0, 5.0], [0.0, 0.0, 5.0, 5.0]])
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0]):
        p = np.hstack([q, [[0.1], [0.1]]])[:, order].copy()
        overlay = Overlay(p, q, STAY)
        assert overlay.refine(0.3) == 5
        assert overlay.partners() == [[0, 1, 2, 3, -1][i] for i in order]


def test_points_outside_the_grid_have_no_partner_and_do_not_count() -> None:
    p = loose_lattice(2)
    overlay = Overlay(p, p[:, :15].copy(), STAY, margin=0.01)
    assert overlay.refine(0.2) == int((p[0] <= overlay.grid.x1).sum()) < 25
    assert (overlay.partner[:15] >= 0).all()
    assert (overlay.partner[15:] < 0).all()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_pairs_determine_no_move(count: int) -> None:
    p = loose_lattice(3)
    q = np.hstack([p[:, :count], [[50.0], [50.0]]])
    assert Overlay(p, q, STAY).refine(0.2) == -1


@given(seeds, st.integers(2, 12))
def test_fit_agrees_with_the_similarity_fit(seed: int, pairs: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 14)), rng.uniform(3, 9, (2, 17))
    grid, move = grid_of(q), np.zeros(4)
    partner = np.full(14, -1, np.int32)
    partner[rng.permutation(14)[:pairs]] = rng.permutation(17)[:pairs]
    assert fit_partners(p, grid, partner, move)
    paired = partner >= 0
    target = np.array([grid.x, grid.y])[:, partner[paired]]
    assert move == pytest.approx(as_move(Similarity.fit(p[:, paired].T, target.T)), abs=1e-9)


@pytest.mark.parametrize(
    ("p", "q", "partner"),
    [
        ([[0, 1], [0, 1]], [[0, 1], [0, 1]], [-1, -1]),
        ([[0, 1], [0, 1]], [[0, 1], [0, 1]], [0, -1]),
        ([[2, 2], [3, 3]], [[0, 1], [0, 1]], [0, 1]),
        ([[0, 1], [0, 1]], [[2, 2], [3, 3]], [0, 1]),
    ],
    ids=["no pair", "one pair", "coincident in P", "coincident in Q"],
)
def test_pairs_that_determine_no_transform_leave_the_move(
    p: list[list[float]], q: list[list[float]], partner: list[int]
) -> None:
    move = np.array([0.5, 0.25, 3.0, 4.0])
    arrays = (np.array(p, float), grid_of(np.array(q, float)), np.array(partner, np.int32), move)
    assert not fit_partners(*arrays)
    assert move.tolist() == [0.5, 0.25, 3.0, 4.0]


@given(seeds, st.integers(0, 20), st.integers(0, 20), st.floats(-8, 1))
def test_chance_is_a_narrow_bound_of_the_binomial_tail(
    seed: int, pairs: int, others: int, exponent: float
) -> None:
    from scipy.stats import binom

    rng = np.random.default_rng(seed)
    t2, expected = rng.uniform(0.1, 9), 10.0**exponent
    inside = pairs + others
    partner = np.full(inside + 3, -1, np.int32)
    partner[rng.permutation(inside + 3)[:pairs]] = np.arange(pairs)
    distance2 = t2 * 4.0 ** rng.uniform(-REACHES, 0, inside + 3)
    found = kernel.log_chance(partner, distance2, inside, t2, expected / (math.pi * t2))
    lowest, highest = 0.0, 0.0
    for part in range(REACHES):
        near = int(((partner >= 0) & (distance2 <= t2 * 0.25**part)).sum())
        if near < 3:
            break
        chance = -math.expm1(-expected * 0.25**part)
        tail = binom.logsf(near - 3, inside - 2, chance) + math.log(REACHES)
        lowest = min(lowest, tail)
        if near - 2 > chance * (inside - 2):  # Chernoff's bound is that near to the tail
            highest = min(highest, tail + math.log(inside - 1))
    assert lowest - 1e-9 <= found <= highest + 1e-9


@pytest.mark.parametrize("inside", [0, 1, 2, 3])
def test_too_few_points_have_no_significance(inside: int) -> None:
    partner = np.arange(min(inside, 2), dtype=np.int32)
    assert kernel.log_chance(partner, np.zeros(len(partner)), inside, 1.0, 1e-3) == 0.0


def test_few_exact_pairs_are_as_significant_as_many_rough_ones() -> None:
    partner = np.arange(10, dtype=np.int32)
    rough, exact = np.full(10, 0.9), np.full(10, 1e-9)
    chance = [kernel.log_chance(partner, d2, 12, 1.0, 0.05) for d2 in (rough, exact)]
    assert chance[1] < chance[0] < 0
    partner[5:] = -1
    assert kernel.log_chance(partner, exact, 12, 1.0, 0.05) < chance[0]


@given(seeds, st.integers(0, 12))
def test_pairs_are_listed_as_they_were_given(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 12)), rng.uniform(0, 1, (2, 15))
    grid, turn = grid_of(q), Similarity(1.1, 0.3, 0.2, -0.1)
    partner = np.full(12, -1, np.int32)
    partner[rng.permutation(12)[:count]] = rng.permutation(15)[:count]
    pairs = np.empty((count, 2), np.int32)
    rms = kernel.list_pairs(p, grid, partner, as_move(turn), pairs)
    assert pairs[:, 0].tolist() == np.flatnonzero(partner >= 0).tolist()
    residual = turn.apply(p[:, pairs[:, 0]].T) - q[:, pairs[:, 1]].T
    assert q[:, pairs[:, 1]].tolist() == [
        [grid.x[at] for at in partner if at >= 0],
        [grid.y[at] for at in partner if at >= 0],
    ]
    assert rms == pytest.approx(math.sqrt((residual**2).sum() / max(count, 1)))


@given(seeds)
@settings(max_examples=15)
def test_compiled_and_interpreted_agree_to_the_last_bit(
    interpreted: Callable[[str], ModuleType], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 4, (2, 20))
    q = np.hstack([p[:, :14] + rng.normal(0, 0.1, (2, 14)), rng.uniform(0, 4, (2, 6))])
    plain, plain_fit = interpreted("_overlay_kernel"), interpreted("_similarity_kernel")
    plain.fit_partners = plain_fit.fit_partners  # type: ignore[attr-defined]
    results = []
    for either, fit_either in ((kernel, fit_partners), (plain, plain_fit.fit_partners)):
        overlay = Overlay(p, q, Similarity(1.01, 0.02, 0.1, -0.05))
        inside = overlay.refine(0.3, either=either)
        paired = overlay.partner >= 0
        chance = either.log_chance(overlay.partner, overlay.distance2, max(inside, 0), 0.09, 1.2)
        pairs = np.empty((np.count_nonzero(paired), 2), np.int32)
        rms = either.list_pairs(p, overlay.grid, overlay.partner, overlay.move, pairs)
        refitted = fit_either(p, overlay.grid, overlay.partner, overlay.move)
        lists = (overlay.partner, overlay.owner, overlay.distance2[paired], overlay.move, pairs)
        results.append((inside, chance, rms, refitted, *(each.tolist() for each in lists)))
    assert results[0] == results[1]

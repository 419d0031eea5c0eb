import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import as_move, grid_of, in_columns, places, seeds

from fpmatch.lab.points.triangles import _overlay_kernel as kernel
from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.similarity import Similarity

REACHES = 8  # of the kernel: t, t/2, t/4 and so on
STAY = Similarity()


def loose_lattice(seed, side=5):
    """Return points no two of which are nearer than 0.7, shape (2, side²)."""
    rng = np.random.default_rng(seed)
    lattice = np.argwhere(np.ones((side, side))).T.astype(float)
    return lattice + rng.uniform(-0.15, 0.15, lattice.shape)


def some_partners(rng, p, q, count):
    partner = np.full(p, -1, np.int32)
    partner[rng.permutation(p)[:count]] = rng.permutation(q)[:count]
    return partner


class Overlay:
    """The arguments of `refine` and its results."""

    def __init__(self, p, q, start, margin=1.0):
        self.p, self.grid, self.move = p, grid_of(q, 0.5, margin), as_move(start)
        self.owner = np.full(q.shape[1], -1, np.int32)
        self.partner = np.full(p.shape[1], -1, np.int32)
        self.visits = np.zeros(1, np.int64)
        self.distance2 = np.full(p.shape[1], np.nan)

    def refine(self, t, rounds=12):
        arrays = (self.owner, self.partner, self.distance2, self.visits, self.move)
        return int(kernel.refine(self.p, self.grid, t * t, rounds, *arrays))


@given(seeds)
def test_a_perturbed_move_is_refined_to_the_true_one(seed):
    rng = np.random.default_rng(seed)
    p, order = loose_lattice(seed), rng.permutation(25)
    truth = Similarity(rng.uniform(0.9, 1.1), rng.uniform(-3, 3), *rng.uniform(-9, 9, 2))
    q = in_columns(truth.apply(p.T[order]))
    nudge = Similarity(
        rng.uniform(0.99, 1.01), rng.uniform(-0.01, 0.01), *rng.uniform(-0.1, 0.1, 2)
    )
    overlay = Overlay(p, q, truth.after(nudge))
    assert overlay.refine(0.25) == 25
    assert overlay.move == pytest.approx(as_move(truth), abs=1e-9)
    assert [overlay.grid.order[at] for at in overlay.partner] == order.argsort().tolist()
    assert overlay.distance2 == pytest.approx(np.zeros(25), abs=1e-15)
    assert overlay.owner[overlay.partner].tolist() == list(range(25))


@pytest.mark.parametrize(("shift", "inside", "paired"), [(0.27, 25, 25), (0.29, -1, 0)])
def test_the_first_round_reaches_twice_as_far_in_area(shift, inside, paired):
    p = loose_lattice(1)
    overlay = Overlay(p, p.copy(), Similarity(tx=shift))
    assert overlay.refine(0.2) == inside
    assert np.count_nonzero(overlay.partner >= 0) == paired


@given(seeds)
def test_pairs_are_nearest_mutual_and_within_reach(seed):
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 4, (2, 20))
    q = np.hstack([p[:, :14] + rng.normal(0, 0.05, (2, 14)), rng.uniform(0, 4, (2, 6))])
    overlay = Overlay(p, q, STAY, margin=4.0)  # all of P lies in the grid
    assert overlay.refine(0.3, rounds=1) == 20
    squared = ((p[:, :, None] - places(overlay.grid)[:, None, :]) ** 2).sum(axis=0)
    for i in range(20):
        at, nearest = int(overlay.partner[i]), int(squared[i].argmin())
        if at >= 0:
            assert (at, overlay.owner[at]) == (nearest, i)
            assert overlay.distance2[i] == squared[i, at] < 0.18
            assert squared[i, at] == squared[squared.argmin(axis=1) == at, at].min()
        else:
            assert squared[i, nearest] >= 0.18 or overlay.owner[nearest] >= 0
    assert np.count_nonzero(overlay.owner >= 0) == np.count_nonzero(overlay.partner >= 0)


def test_points_outside_the_grid_have_no_partner_and_do_not_count():
    p = loose_lattice(2)
    overlay = Overlay(p, p[:, :15].copy(), STAY, margin=0.01)
    assert overlay.refine(0.2) == int((p[0] <= overlay.grid.x1).sum()) < 25
    assert (overlay.partner[:15] >= 0).all()
    assert (overlay.partner[15:] < 0).all()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_pairs_determine_no_move(count):
    p = loose_lattice(3)
    q = np.hstack([p[:, :count], [[50.0], [50.0]]])
    assert Overlay(p, q, STAY).refine(0.2) == -1


@given(seeds, st.integers(2, 12))
def test_fit_agrees_with_the_similarity_fit(seed, pairs):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 14)), rng.uniform(3, 9, (2, 17))
    grid, move = grid_of(q, 0.5), np.zeros(4)
    partner = some_partners(rng, 14, 17, pairs)
    assert fit_partners(p, grid, partner, move)
    target = places(grid)[:, partner[partner >= 0]]
    assert move == pytest.approx(as_move(Similarity.fit(p[:, partner >= 0].T, target.T)), abs=1e-9)


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
def test_pairs_that_determine_no_transform_leave_the_move(p, q, partner):
    move = np.array([0.5, 0.25, 3.0, 4.0])
    grid = grid_of(np.array(q, float), 0.5)
    assert not fit_partners(np.array(p, float), grid, np.array(partner, np.int32), move)
    assert move.tolist() == [0.5, 0.25, 3.0, 4.0]


@given(seeds, st.integers(0, 20), st.integers(0, 20), st.floats(-8, 1))
def test_chance_is_a_narrow_bound_of_the_binomial_tail(seed, pairs, others, exponent):
    from scipy.stats import binom

    rng = np.random.default_rng(seed)
    t2, expected = rng.uniform(0.1, 9), 10.0**exponent
    inside = pairs + others
    partner = some_partners(rng, inside + 3, inside + 3, pairs)
    distance2 = t2 * 4.0 ** rng.uniform(-REACHES, 0, inside + 3)
    density = expected / (math.pi * t2)
    rate = np.empty(REACHES)
    kernel.uniform_rates(density, t2, rate)
    assert rate == pytest.approx([-math.expm1(-expected / 4**k) for k in range(REACHES)])
    found = kernel.log_chance(partner, distance2, inside, t2, rate)
    lowest, highest = 0.0, 0.0
    for part in range(REACHES):
        near = int(((partner >= 0) & (distance2 <= t2 * 0.25**part)).sum())
        if near <= 2:
            break
        chance = -math.expm1(-expected * 0.25**part)
        tail = binom.logsf(near - 3, inside - 2, chance) + math.log(REACHES)
        lowest = min(lowest, tail)
        trials = inside - 2
        if near - 2 > chance * trials:  # Chernoff's bound is that near to the tail
            highest = min(highest, tail + math.log(trials + 1))
    assert lowest - 1e-9 <= found <= highest + 1e-9


@given(seeds, st.integers(0, 12))
def test_pairs_are_listed_as_they_were_given(seed, count):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, 12)), rng.uniform(0, 1, (2, 15))
    grid, turn = grid_of(q, 0.5), Similarity(1.1, 0.3, 0.2, -0.1)
    partner = some_partners(rng, 12, 15, count)
    pairs = np.empty((count, 2), np.int32)
    rms = kernel.list_pairs(p, grid, partner, as_move(turn), pairs)
    assert pairs[:, 0].tolist() == np.flatnonzero(partner >= 0).tolist()
    assert q[:, pairs[:, 1]].tolist() == places(grid)[:, partner[partner >= 0]].tolist()
    residual = turn.apply(p[:, pairs[:, 0]].T) - q[:, pairs[:, 1]].T
    assert rms == pytest.approx(math.sqrt((residual**2).sum() / max(count, 1)))


def uniform_rate(t, reaches=3):
    rate = np.empty(reaches)
    kernel.uniform_rates(1.0, t * t, rate)
    return rate


@given(seeds, st.sampled_from([0.3, 1.0]))
def test_local_rates_agree_with_their_twin(seed, t):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 6, (2, 9)), rng.uniform(0, 6, (2, 30)) * [[1], [rng.choice([0.01, 1])]]
    grid, partner = grid_of(q, 0.5, 4.0), some_partners(rng, 9, 30, 4)
    each, rate, most = np.full((3, 9), np.nan), np.empty(3), 5
    room = np.empty(most, np.int32), np.empty(most)
    arrays = p, grid, as_move(STAY), partner
    count = kernel.local_rates(*arrays, 2, 2.25, t * t, *room, each, rate)
    expected = []
    for i in range(0, 9, 2):
        x, y = p[:, i]
        if not (grid.x0 <= x <= grid.x1 and grid.y0 <= y <= grid.y1):
            continue
        away = places(grid) - p[:, i : i + 1]
        squared = (away**2).sum(axis=0)
        near = [k for k in squared.argsort(kind="stable")[:most] if squared[k] <= 2.25]
        others = [k for k in near if k != partner[i]][: most - 1]
        column = []
        for part in range(3):
            r2 = t * t / 4**part
            if len(others) < 3:
                moments = np.eye(2) * 2.25 / 4
            else:
                moments = away[:, others] @ away[:, others].T / len(others)
            number = len(others) + (len(others) < 3)
            area = 4 * math.sqrt(np.linalg.det(moments + np.eye(2) * r2 / 4))
            hits = number * r2 / area
            if 4 * np.linalg.det(moments) < 0.2 * moments.trace() ** 2:
                hits = max(hits, number * math.sqrt(r2 / squared[others].max()))
            column.append(-math.expm1(-hits))
        expected.append(column)
    assert count == len(expected)
    assert pytest.approx(np.array(expected), rel=1e-6) == each[:, :count].T
    assert rate == pytest.approx(np.mean(expected, axis=0), rel=1e-6)


def test_rivals_of_a_row_shift_it_along_itself():
    row = np.vstack([np.arange(12.0), np.zeros(12)])
    mesh = triangulate(np.vstack([row.T, [[5.5, 9.0]]]))
    points = np.array(mesh.points.T, order="C")
    grid, t = grid_of(points, 0.5, 1.0), 0.2
    partner = np.asarray(grid.order).argsort().astype(np.int32)
    moves, apart = np.empty((38, 4)), np.empty(30)
    rings = points, mesh.ring_start, mesh.ring
    rest = *rings, as_move(STAY), 8, 0.1, apart, moves, 0
    count = kernel.rival_moves(points, grid, partner, 4, 5, *rest)
    shifts = mesh.ring_start[5] - mesh.ring_start[4]
    assert shifts == 3  # to both neighbours in the row, and to the point beside it
    steps = moves[shifts:count]
    assert len(steps) == 2 * 11 - 1  # all steps of the row but the known one
    assert moves[:shifts, :2].tolist() == [[1.0, 0.0]] * shifts
    assert sorted(moves[:shifts, 2]) == pytest.approx([-1.0, 1.0, 1.5])
    assert np.abs(steps[:, 0]) == pytest.approx(1)
    assert steps[:, [1, 3]] == pytest.approx(0, abs=1e-12)
    assert (apart[: len(steps)] == 0).all()
    room = np.full(13, -1, np.int32), np.full(13, -1, np.int32), np.empty(13)
    arguments = points, grid, t * t, uniform_rate(t), -7.0
    rest = partner, *room, np.zeros(1, np.int64)
    assert kernel.has_rival(*arguments, moves[:count].copy(), *rest)
    assert not kernel.has_rival(*arguments, as_move(STAY)[None], *rest)

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import as_move, grid_of, in_columns, moved, places, seeds
from scipy.optimize import linear_sum_assignment

from fpmatch.lab.points.triangles import _overlay_kernel as kernel
from fpmatch.pointset.geometry.similarity import Similarity

STAY = Similarity()


def loose_lattice(seed, side=5):
    """Return points no two of which are nearer than 0.7, shape (2, side²)."""
    rng = np.random.default_rng(seed)
    lattice = np.argwhere(np.ones((side, side))).T.astype(float)
    return lattice + rng.uniform(-0.15, 0.15, lattice.shape)


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


@given(seeds)
def test_pairs_are_nearest_mutual_and_within_reach(seed):
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 4, (2, 20))
    q = np.hstack([p[:, :14] + rng.normal(0, 0.05, (2, 14)), rng.uniform(0, 4, (2, 6))])
    overlay = Overlay(p, q, STAY, margin=4.0)  # all of P lies in the grid
    assert overlay.refine(0.3, rounds=1) == 20
    assert overlay.visits[0] == 20
    squared = ((p[:, :, None] - places(overlay.grid)[:, None, :]) ** 2).sum(axis=0)
    for i in range(20):
        at, nearest = int(overlay.partner[i]), int(squared[i].argmin())
        if at >= 0:
            assert (at, overlay.owner[at]) == (nearest, i)
            assert overlay.distance2[i] == squared[i, at] < 0.18
            assert squared[i, at] == squared[squared.argmin(axis=1) == at, at].min()
        else:
            assert squared[i, nearest] >= 0.18 or overlay.owner[nearest] >= 0
    paired = overlay.partner >= 0
    fit = Similarity.fit(p.T[paired], places(overlay.grid).T[overlay.partner[paired]])
    assert overlay.move == pytest.approx(as_move(fit), abs=1e-9)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_pairs_determine_no_move(count):
    p = loose_lattice(3)
    q = np.hstack([p[:, :count], [[50.0], [50.0]]])
    assert Overlay(p, q, STAY).refine(0.2) == -1


@pytest.mark.parametrize(
    ("p", "q", "partner"),
    [
        ([[0, 1], [0, 1]], [[0, 1], [0, 1]], [0, -1]),
        ([[2, 2], [3, 3]], [[0, 1], [0, 1]], [0, 1]),
        ([[0, 1], [0, 1]], [[2, 2], [3, 3]], [0, 1]),
    ],
    ids=["one pair", "coincident in P", "coincident in Q"],
)
def test_pairs_that_determine_no_transform_leave_the_move(p, q, partner):
    move = np.array([0.5, 0.25, 3.0, 4.0])
    grid = grid_of(np.array(q, float), 0.5)
    assert not kernel.fit_partners(np.array(p, float), grid, np.array(partner, np.int32), move)
    assert move.tolist() == [0.5, 0.25, 3.0, 4.0]


@given(seeds, st.integers(0, 12), st.integers(0, 15), st.sampled_from([0.05, 0.2, 0.5, 3.0]))
def test_the_pairing_is_the_best_to_a_thousandth_of_the_tolerance(seed, n, m, t):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(0, 1, (2, n)), rng.uniform(0, 1, (2, m)).round(rng.choice([1, 9]))
    grid, move = grid_of(q, 0.3), np.array([0.9, 0.2, 0.0, -0.1])
    owner, partner = np.full(m, -1, np.int32), np.full(n, -1, np.int32)
    kernel.pair_by_auction(p, grid, move, t * t, owner, partner)
    apart = moved(p, move)[:, :, None] - places(grid)[:, None, :]
    gain = np.maximum(t * t - (apart**2).sum(axis=0), 0.0)
    nearest = -np.sort(-gain, axis=1)[:, 11:12] if m > 12 else np.zeros((n, 1))
    gain[gain < nearest] = 0.0  # the twelve nearest are candidates
    paired = np.flatnonzero(partner >= 0)
    assert owner[partner[paired]].tolist() == paired.tolist()
    assert np.count_nonzero(owner >= 0) == len(paired)
    assert (gain[paired, partner[paired]] > 0.0).all()
    best = gain[linear_sum_assignment(gain, maximize=True)].sum()
    assert gain[paired, partner[paired]].sum() >= best - (n + 1) * t * t / 1000

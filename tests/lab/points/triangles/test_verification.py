import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import as_move, places, seeds

from fpmatch.lab.points.triangles.given_set import REACHES, GivenSet, Target
from fpmatch.lab.points.triangles.verification import Overlaid, Verification
from fpmatch.pointset.geometry.similarity import Similarity

STAY = as_move(Similarity())


@given(seeds, st.integers(0, 20), st.integers(0, 20), st.floats(-8, 1))
def test_chance_is_a_narrow_bound_of_the_binomial_tail(seed, pairs, others, exponent):
    from scipy.stats import binom

    rng = np.random.default_rng(seed)
    t2, expected = rng.uniform(0.1, 9), 10.0**exponent
    inside = pairs + others
    distance2 = np.full(inside + 3, np.inf)
    distance2[rng.permutation(inside + 3)[:pairs]] = t2 * 4.0 ** rng.uniform(-8, 0, pairs)
    rate = -np.expm1(-expected * REACHES)
    overlaid = Overlaid(STAY, np.empty(0, np.int32), distance2, inside)
    lowest, highest = 0.0, 0.0
    for share, chance in zip(REACHES, rate, strict=True):
        near = int((distance2 <= t2 * share).sum())
        if near <= 2:
            break
        tail = binom.logsf(near - 3, inside - 2, chance) + math.log(len(REACHES))
        lowest = min(lowest, tail)
        trials = inside - 2
        if near - 2 > chance * trials:  # Chernoff's bound is that near to the tail
            highest = min(highest, tail + math.log(trials + 1))
    assert lowest - 1e-9 <= overlaid.log_chance(t2, rate) <= highest + 1e-9


def verification(p, q, tolerance):
    given_q = GivenSet("q", q)
    target = Target.of(given_q, tolerance)
    return Verification(p, given_q, target, np.zeros(1, np.int64), 10**9), target


@given(seeds, st.sampled_from([0.3, 1.0]))
def test_local_rates_agree_with_their_twin(seed, t):
    rng = np.random.default_rng(seed)
    p, q = rng.uniform(-2, 8, (2, 9)), rng.uniform(0, 6, (30, 2)) * [1, rng.choice([0.01, 1])]
    judge, target = verification(p, q, t)
    grid, wide2, t2 = target.grid, (2.5 * target.spacing) ** 2, target.tolerance**2
    partner = np.full(9, -1, np.int32)
    partner[rng.permutation(9)[:4]] = rng.permutation(30)[:4]
    is_inside, rates = judge._local_rates(p, STAY, partner)
    expected = []
    for i in range(9):
        x, y = p[:, i]
        assert is_inside[i] == (grid.x0 <= x <= grid.x1 and grid.y0 <= y <= grid.y1)
        if not is_inside[i]:
            continue
        away = places(grid) - p[:, i : i + 1]
        squared = (away**2).sum(axis=0)
        near = [k for k in squared.argsort(kind="stable")[:9] if squared[k] < wide2]
        others = [k for k in near if k != partner[i]][:8]
        column = []
        for r2 in t2 * REACHES:
            if len(others) < 3:
                moments = np.eye(2) * wide2 / 4
            else:
                moments = away[:, others] @ away[:, others].T / len(others)
            number = len(others) + (len(others) < 3)
            area = 4 * math.sqrt(max(np.linalg.det(moments + np.eye(2) * r2 / 4), 0))
            hits = number * r2 / area
            if 4 * np.linalg.det(moments) < 0.2 * moments.trace() ** 2:
                hits = max(hits, number * math.sqrt(r2 / squared[others].max()))
            column.append(-math.expm1(-hits))
        expected.append(column)
    assert pytest.approx(np.reshape(expected, (-1, 8)), rel=1e-5) == rates.T


def test_rivals_of_a_row_shift_it_along_itself():
    points = np.vstack([np.column_stack([np.arange(12.0), np.zeros(12)]), [[5.5, 9.0]]])
    judge, target = verification(np.array(points.T, order="C"), points, 0.2)
    partner = np.asarray(target.grid.order).argsort().astype(np.int32)
    overlaid = SimpleNamespace(move=STAY, partner=partner)
    moves, most = judge._rival_moves(overlaid, np.arange(13), 30)
    shifts = moves[(moves[:, :2] == [1.0, 0.0]).all(axis=1)]
    assert {*shifts[:, 2].round(9)} >= {-1.0, 1.0}
    steps = moves[np.abs(moves[:, 3]) < 1e-9]
    assert np.abs(steps[:, 0]) == pytest.approx(1)
    assert len(steps) > 2 * 2 * 11 - 2  # of some bases in the row: all its steps but the known
    assert 21 <= most <= 21 + 8
    ours = judge.overlay(judge._points, STAY, 12)
    verdict = judge.judge(ours, 0.0, math.log(1e-3))
    assert verdict.has_rivals or verdict.log_chance >= math.log(1e-3)

"""Trials by fake matchers on a fake clock: what is counted, and when a cell ends."""

from __future__ import annotations

import gc
import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.evaluation.points import trials as point_trials
from fpmatch.evaluation.points.matchers import BenchMatcher, Claim, PointCase, StoppedError
from fpmatch.evaluation.points.places import Place, make_pair
from fpmatch.evaluation.points.trials import QUICK_PLAN, TrialPlan, is_recognised, run_cell
from fpmatch.pointset.random_sets import RandomPair
from fpmatch.pointset.similarity import Similarity

PLACE = Place("patch", 0, 2)
PLAN = TrialPlan(trials=20, budget_s=10.0, fewest_trials=5)
PAIR = make_pair(PLACE, 0, 0, genuine=True)


class World:
    """Tell the time, know the truth about the pair on trial, and note what happens."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, scipy_s: float = 0.001) -> None:
        self.now = 0.0
        self.pair: RandomPair | None = None
        self.events: list[str] = []
        self.made: list[tuple[int, bool]] = []

        def made(place: Place, seed: int, trial: int, *, genuine: bool) -> RandomPair:
            self.pair = make_pair(place, seed, trial, genuine=genuine)
            self.made.append((trial, genuine))
            return self.pair

        def triangulated(_: PointCase) -> None:
            self.now += scipy_s
            self.events.append("scipy")

        monkeypatch.setattr(point_trials, "make_pair", made)
        monkeypatch.setattr(point_trials, "_triangulate_both", triangulated)

    def clock(self) -> float:
        return self.now

    def truth(self) -> Claim | None:
        if self.pair is None or self.pair.transform is None:
            return None
        return Claim(self.pair.transform, self.pair.pairs)

    def matcher(
        self,
        seconds: float = 0.1,
        answer: Callable[[PointCase], Claim | None] | None = None,
        *,
        complete: bool = False,
    ) -> BenchMatcher:
        """Return a matcher that takes so long and gives an answer, the truth by default."""

        def find(case: PointCase) -> Claim | None:
            if self.made:  # not while warming up
                self.now += seconds
                self.events.append("match")
            return answer(case) if answer else self.truth()

        return BenchMatcher("fake", find, complete)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    return World(monkeypatch)


def test_the_truth_is_recognised() -> None:
    assert is_recognised(Claim(PAIR.transform, PAIR.pairs), PAIR)


@pytest.mark.parametrize("claim", [None, Claim(Similarity(), PAIR.pairs)])
def test_no_match_and_another_transform_are_not(claim: Claim | None) -> None:
    assert not is_recognised(claim, PAIR)


@pytest.mark.parametrize(("share", "recognised"), [(0.99, True), (1.01, False)])
def test_every_point_has_to_come_within_t_of_its_place(share: float, recognised: bool) -> None:
    shift = share * PAIR.tolerance
    moved = replace(PAIR.transform, tx=PAIR.transform.tx + shift)
    assert is_recognised(Claim(moved, PAIR.pairs), PAIR) is recognised


@pytest.mark.parametrize(("missing", "recognised"), [(9, True), (10, False)])
def test_four_fifths_of_the_true_pairs_have_to_be_found(missing: int, recognised: bool) -> None:
    assert len(PAIR.pairs) == 48
    wrong = np.column_stack([PAIR.pairs[:missing, 0], (PAIR.pairs[:missing, 1] + 1) % 100])
    pairs = np.vstack([wrong, PAIR.pairs[missing:]]).astype(np.int32)
    assert is_recognised(Claim(PAIR.transform, pairs), PAIR) is recognised


def test_a_cell_counts_and_takes_medians(world: World) -> None:
    cell = run_cell(PLACE, world.matcher(0.1), PLAN, world.clock)
    assert (cell.outcomes, cell.false_matches, cell.independent_trials) == ("1" * 20, 0, 20)
    assert (cell.place, cell.matcher, cell.stopped) == (PLACE, "fake", 0)
    assert cell.time_ms == pytest.approx(100)
    assert cell.independent_time_ms == pytest.approx(100)
    assert cell.first_ms == pytest.approx(100)
    assert cell.scipy_delaunay_ms == pytest.approx(1)
    assert world.made == [(k, genuine) for genuine in (True, True, False) for k in range(20)]


def test_outcomes_stand_in_the_order_of_the_trials(world: World) -> None:
    def every_other(_: PointCase) -> Claim | None:
        return None if len(world.made) % 2 else world.truth()

    cell = run_cell(PLACE, world.matcher(answer=every_other), PLAN, world.clock)
    assert cell.outcomes == "01" * 10
    assert cell.recognised == 0.5


def test_any_claim_on_an_independent_pair_is_a_false_match(world: World) -> None:
    def always(_: PointCase) -> Claim:
        return Claim(Similarity(), PAIR.pairs[:1])

    cell = run_cell(PLACE, world.matcher(answer=always), PLAN, world.clock)
    assert (cell.recognised, cell.false_match) == (0.0, 1.0)


def test_scipy_has_the_genuine_pairs_in_a_batch_of_its_own(world: World) -> None:
    run_cell(PLACE, world.matcher(), replace(PLAN, trials=4), world.clock)
    assert world.events == ["scipy", *["match"] * 4, *["scipy"] * 4, *["match"] * 4]
    assert world.made[4:8] == world.made[:4]


@pytest.mark.parametrize(
    ("seconds", "trials"),
    [
        (1.0, 10),  # until the budget is spent
        (3.0, 5),  # five all the same
        (9.9, 5),
        (10.5, 5),
        (25.0, 4),  # but no longer than ten budgets
        (0.1, 20),
    ],
)
def test_a_cell_ends_when_its_budget_is_spent(world: World, seconds: float, trials: int) -> None:
    cell = run_cell(PLACE, world.matcher(seconds), PLAN, world.clock)
    assert (cell.trials, cell.independent_trials) == (trials, trials)


def test_a_complete_matcher_goes_on(world: World) -> None:
    matcher = world.matcher(11.0, complete=True)
    cell = run_cell(PLACE, matcher, PLAN, world.clock)
    assert (cell.trials, cell.independent_trials) == (20, 20)
    quick = run_cell(PLACE, matcher, replace(QUICK_PLAN, budget_s=10.0), world.clock)
    assert (quick.trials, quick.independent_trials) == (1, 1)


def test_a_match_that_is_stopped_counts_as_none(world: World) -> None:
    def stopped_later(_: PointCase) -> Claim | None:
        if len(world.made) > 1:
            raise StoppedError
        return world.truth()

    cell = run_cell(PLACE, world.matcher(2.0, stopped_later), PLAN, world.clock)
    assert (cell.outcomes, cell.false_matches, cell.stopped) == ("10000", 0, 9)


def test_a_first_match_that_is_stopped_leaves_no_cell(world: World) -> None:
    def stopped(_: PointCase) -> None:
        raise StoppedError

    with pytest.raises(StoppedError):
        run_cell(PLACE, world.matcher(11.0, stopped), PLAN, world.clock)


def test_garbage_is_not_collected_during_a_call_and_is_afterwards(world: World) -> None:
    states = []

    def noted(_: PointCase) -> None:
        if world.made:
            states.append(gc.isenabled())

    run_cell(PLACE, world.matcher(answer=noted), replace(PLAN, trials=2), world.clock)
    assert states == [False] * 4
    assert gc.isenabled()


def test_a_matcher_is_told_t_rho_lambda_and_its_bounds(world: World) -> None:
    cases = []

    def noted(case: PointCase) -> None:
        if world.made:
            cases.append(case)

    run_cell(PLACE, world.matcher(answer=noted), replace(PLAN, trials=1), world.clock)
    for case, looks in zip(cases, (PLAN.genuine_looks, PLAN.independent_looks), strict=True):
        assert (case.rho, case.lambda_) == (0.95, 0.428)
        assert case.tolerance == pytest.approx(0.214)
        assert (case.max_steps, case.limit_s) == (looks, PLAN.budget_s)


def test_a_cell_is_json_without_nan(world: World) -> None:
    cell = run_cell(PLACE, world.matcher(), replace(PLAN, trials=1), world.clock)
    json.dumps(cell.as_json(), allow_nan=False)


def test_scipy_triangulates_both_sets() -> None:
    case = PointCase(PAIR.p, PAIR.q, PAIR.tolerance, 0.95, 0.428, 1, 1.0)
    point_trials._triangulate_both(case)


def test_averages_stand_beside_medians(world: World) -> None:
    seconds = iter([0.1, 0.1, 0.4] * 2)

    def find(_: PointCase) -> Claim | None:
        if world.made:
            world.now += next(seconds)
        return world.truth()

    cell = run_cell(PLACE, BenchMatcher("fake", find), replace(PLAN, trials=3), world.clock)
    assert (cell.time_ms, cell.mean_ms) == pytest.approx((100, 200))
    assert (cell.independent_time_ms, cell.independent_mean_ms) == pytest.approx((100, 200))


def test_independent_pairs_may_be_fewer(world: World) -> None:
    plan = replace(PLAN, trials=6, independent_trials=2)
    cell = run_cell(PLACE, world.matcher(), plan, world.clock)
    assert (cell.trials, cell.independent_trials) == (6, 2)

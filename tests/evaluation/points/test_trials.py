"""Trials by fake matchers on a fake clock: what is counted, and when a cell ends."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.evaluation.points import trials as point_trials
from fpmatch.evaluation.points.conditions import Condition, make_pair
from fpmatch.evaluation.points.matchers import BenchMatcher, PointCase, StoppedError
from fpmatch.evaluation.points.trials import QUICK_PLAN, TrialPlan, is_recognised, run_cell
from fpmatch.pointset.point_match import PointMatch
from fpmatch.pointset.random_sets import RandomPair
from fpmatch.pointset.similarity import Similarity

CONDITION = Condition("patch", 0, 2)
PLAN = TrialPlan(trials=20, budget_s=10.0, fewest_trials=5)
PAIR = make_pair(CONDITION, 0, 0, genuine=True)
NO_MATCH = PointMatch.none()


def found(transform: Similarity | None, pairs: np.ndarray) -> PointMatch:
    return PointMatch(transform, pairs, 1.0, 0.0, 1)


class World:
    """A clock, the truth about the pair on trial, and a record of events."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, scipy_s: float = 0.001) -> None:
        self.now = 0.0
        self.pair: RandomPair | None = None
        self.events: list[str] = []
        self.made: list[tuple[int, bool]] = []

        def made(condition: Condition, seed: int, trial: int, *, genuine: bool) -> RandomPair:
            self.pair = make_pair(condition, seed, trial, genuine=genuine)
            self.made.append((trial, genuine))
            return self.pair

        def triangulated(_: PointCase) -> None:
            self.now += scipy_s
            self.events.append("scipy")

        monkeypatch.setattr(point_trials, "make_pair", made)
        monkeypatch.setattr(point_trials, "_triangulate_both", triangulated)

    def clock(self) -> float:
        return self.now

    def truth(self) -> PointMatch:
        return NO_MATCH if self.pair is None else found(self.pair.transform, self.pair.pairs)

    def matcher(
        self,
        seconds: float = 0.1,
        answer: Callable[[PointCase], PointMatch] | None = None,
        *,
        complete: bool = False,
    ) -> BenchMatcher:
        """Return a matcher that takes so long and gives an answer, the truth by default."""

        def find(case: PointCase) -> PointMatch:
            if self.made:  # not while warming up
                self.now += seconds
                self.events.append("match")
            return answer(case) if answer else self.truth()

        return BenchMatcher("fake", find, complete)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    return World(monkeypatch)


def test_the_truth_is_recognised_but_no_match_and_no_other_transform() -> None:
    assert is_recognised(found(PAIR.transform, PAIR.pairs), PAIR)
    for match in (None, NO_MATCH, found(Similarity(), PAIR.pairs)):
        assert not is_recognised(match, PAIR)


@pytest.mark.parametrize(("share", "recognised"), [(0.99, True), (1.01, False)])
def test_every_point_has_to_come_within_t_of_its_place(share: float, recognised: bool) -> None:
    shift = share * PAIR.tolerance
    moved = replace(PAIR.transform, tx=PAIR.transform.tx + shift)
    assert is_recognised(found(moved, PAIR.pairs), PAIR) is recognised


@pytest.mark.parametrize(("missing", "recognised"), [(9, True), (10, False)])
def test_four_fifths_of_the_true_pairs_have_to_be_found(missing: int, recognised: bool) -> None:
    assert len(PAIR.pairs) == 48
    wrong = np.column_stack([PAIR.pairs[:missing, 0], (PAIR.pairs[:missing, 1] + 1) % 100])
    pairs = np.vstack([wrong, PAIR.pairs[missing:]]).astype(np.int32)
    assert is_recognised(found(PAIR.transform, pairs), PAIR) is recognised


def test_a_cell_counts_and_takes_medians(world: World) -> None:
    cell = run_cell(CONDITION, world.matcher(0.1), PLAN, world.clock)
    assert (cell.outcomes, cell.false_positives, cell.independent_trials) == ("1" * 20, 0, 20)
    assert (cell.condition, cell.matcher, cell.stopped) == (CONDITION, "fake", 0)
    assert cell.time_ms == pytest.approx(100)
    assert cell.independent_time_ms == pytest.approx(100)
    assert cell.first_ms == pytest.approx(100)
    assert cell.scipy_delaunay_ms == pytest.approx(1)
    assert world.made == [(k, genuine) for genuine in (True, True, False) for k in range(20)]


def test_outcomes_are_in_the_order_of_the_trials(world: World) -> None:
    def every_other(_: PointCase) -> PointMatch:
        return NO_MATCH if len(world.made) % 2 else world.truth()

    cell = run_cell(CONDITION, world.matcher(answer=every_other), PLAN, world.clock)
    assert cell.outcomes == "01" * 10
    assert cell.true_positive_rate == 0.5


def test_any_match_of_an_independent_pair_is_a_false_positive(world: World) -> None:
    matcher = world.matcher(answer=lambda _: found(Similarity(), PAIR.pairs[:1]))
    cell = run_cell(CONDITION, matcher, PLAN, world.clock)
    assert (cell.true_positive_rate, cell.false_positive_rate) == (0.0, 1.0)


def test_scipy_has_the_genuine_pairs_in_a_batch_of_its_own(world: World) -> None:
    run_cell(CONDITION, world.matcher(), replace(PLAN, trials=4), world.clock)
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
    cell = run_cell(CONDITION, world.matcher(seconds), PLAN, world.clock)
    assert (cell.trials, cell.independent_trials) == (trials, trials)


def test_a_complete_matcher_goes_on(world: World) -> None:
    matcher = world.matcher(11.0, complete=True)
    cell = run_cell(CONDITION, matcher, PLAN, world.clock)
    assert (cell.trials, cell.independent_trials) == (20, 20)
    quick = run_cell(CONDITION, matcher, replace(QUICK_PLAN, budget_s=10.0), world.clock)
    assert (quick.trials, quick.independent_trials) == (1, 1)


def test_a_match_that_is_stopped_counts_as_none(world: World) -> None:
    def stopped_later(_: PointCase) -> PointMatch:
        if len(world.made) > 1:
            raise StoppedError
        return world.truth()

    cell = run_cell(CONDITION, world.matcher(2.0, stopped_later), PLAN, world.clock)
    assert (cell.outcomes, cell.false_positives, cell.stopped) == ("10000", 0, 9)


def test_a_first_match_that_is_stopped_leaves_no_cell(world: World) -> None:
    def stopped(_: PointCase) -> PointMatch:
        raise StoppedError

    with pytest.raises(StoppedError):
        run_cell(CONDITION, world.matcher(11.0, stopped), PLAN, world.clock)


def test_a_case_has_t_rho_lambda_and_bounds_and_no_garbage_is_collected(world: World) -> None:
    cases, collecting = [], []

    def noted(case: PointCase) -> PointMatch:
        if world.made:
            cases.append(case)
            collecting.append(gc.isenabled())
        return NO_MATCH

    run_cell(CONDITION, world.matcher(answer=noted), replace(PLAN, trials=1), world.clock)
    assert collecting == [False, False]
    assert gc.isenabled()
    for case, steps in zip(cases, (PLAN.genuine_steps, PLAN.independent_steps), strict=True):
        assert (case.rho, case.lambda_) == (0.95, 0.428)
        assert case.tolerance == pytest.approx(0.214)
        assert (case.max_steps, case.limit_s) == (steps, PLAN.budget_s)


def test_cells_have_means_and_medians(world: World) -> None:
    seconds = iter([0.1, 0.1, 0.4] * 2)

    def find(_: PointCase) -> PointMatch:
        if world.made:
            world.now += next(seconds)
        return world.truth()

    cell = run_cell(CONDITION, BenchMatcher("fake", find), replace(PLAN, trials=3), world.clock)
    assert (cell.time_ms, cell.mean_ms) == pytest.approx((100, 200))
    assert (cell.independent_time_ms, cell.independent_mean_ms) == pytest.approx((100, 200))


def test_independent_pairs_may_be_fewer(world: World) -> None:
    plan = replace(PLAN, trials=6, independent_trials=2)
    cell = run_cell(CONDITION, world.matcher(), plan, world.clock)
    assert (cell.trials, cell.independent_trials) == (6, 2)

import gc
from dataclasses import replace

import pytest

from fpmatch.pointset.geometry.point_match import PointMatch
from fpmatch.pointset.geometry.similarity import Similarity
from research.points import trials as point_trials
from research.points.conditions import Condition, make_pair
from research.points.matchers import BenchMatcher, StoppedError
from research.points.trials import QUICK_PLAN, TrialPlan, is_recognised, run_cell

CONDITION = Condition("patch", 0, 2)
PLAN = TrialPlan(trials=20, budget_s=10.0, fewest_trials=5)
PAIR = make_pair(CONDITION, 0, 0, genuine=True)
NO_MATCH = PointMatch.none()


def found(transform, pairs):
    return PointMatch(transform, pairs, 1.0, 0.0, 1)


class World:
    """A clock, the truth about the pair on trial, and a record of events."""

    def __init__(self, monkeypatch):
        self.now, self.pair, self.events, self.made = 0.0, None, [], []

        def made(condition, seed, trial, *, genuine):
            self.pair = make_pair(condition, seed, trial, genuine=genuine)
            self.made.append((trial, genuine))
            return self.pair

        def triangulated(_):
            self.now += 0.001
            self.events.append("scipy")

        monkeypatch.setattr(point_trials, "make_pair", made)
        monkeypatch.setattr(point_trials, "_triangulate_both", triangulated)

    def truth(self):
        return NO_MATCH if self.pair is None else found(self.pair.transform, self.pair.pairs)

    def run(self, seconds=0.1, answer=None, *, plan=PLAN, complete=False):
        """Run a cell of a matcher that takes so long and gives an answer, the truth by default."""
        times = iter(seconds) if isinstance(seconds, list) else iter(lambda: seconds, None)

        def find(case):
            if self.made:  # not while warming up
                self.now += next(times)
                self.events.append("match")
            return answer(case) if answer else self.truth()

        return run_cell(CONDITION, BenchMatcher("fake", find, complete), plan, lambda: self.now)


@pytest.fixture
def world(monkeypatch):
    return World(monkeypatch)


def test_the_truth_is_recognised_but_no_match_and_no_other_transform():
    assert is_recognised(found(PAIR.transform, PAIR.pairs), PAIR)
    for match in (None, NO_MATCH, found(Similarity(), PAIR.pairs)):
        assert not is_recognised(match, PAIR)


@pytest.mark.parametrize(("share", "recognised"), [(0.99, True), (1.01, False)])
def test_every_point_has_to_come_within_t_of_its_place(share, recognised):
    moved = replace(PAIR.transform, tx=PAIR.transform.tx + share * PAIR.tolerance)
    assert is_recognised(found(moved, PAIR.pairs), PAIR) is recognised


@pytest.mark.parametrize(("missing", "recognised"), [(9, True), (10, False)])
def test_four_fifths_of_the_true_pairs_have_to_be_found(missing, recognised):
    assert len(PAIR.pairs) == 48
    pairs = PAIR.pairs.copy()
    pairs[:missing, 1] = (pairs[:missing, 1] + 1) % 100
    assert is_recognised(found(PAIR.transform, pairs), PAIR) is recognised


def test_a_cell_counts_and_takes_medians_and_means(world):
    cell = world.run([0.1, 0.1, 0.4] * 2, plan=replace(PLAN, trials=3))
    assert (cell.outcomes, cell.false_positives, cell.independent_trials) == ("111", 0, 3)
    assert (cell.condition, cell.matcher, cell.stopped) == (CONDITION, "fake", 0)
    assert (cell.time_ms, cell.mean_ms, cell.first_ms) == pytest.approx((100, 200, 100))
    assert (cell.independent_time_ms, cell.independent_mean_ms) == pytest.approx((100, 200))
    assert cell.scipy_delaunay_ms == pytest.approx(1)
    # scipy has the genuine pairs in a batch of its own
    assert world.made == [(k, genuine) for genuine in (True, True, False) for k in range(3)]
    assert world.events == ["scipy", *["match"] * 3, *["scipy"] * 3, *["match"] * 3]


def test_outcomes_are_in_the_order_of_the_trials(world):
    cell = world.run(answer=lambda _: NO_MATCH if len(world.made) % 2 else world.truth())
    assert (cell.outcomes, cell.true_positive_rate) == ("01" * 10, 0.5)


def test_any_match_of_an_independent_pair_is_a_false_positive(world):
    cell = world.run(answer=lambda _: found(Similarity(), PAIR.pairs[:1]))
    assert (cell.true_positive_rate, cell.false_positive_rate) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("seconds", "trials"),
    [
        (1.0, 10),  # until the budget is spent
        (3.0, 5),  # five all the same
        (10.5, 5),
        (25.0, 4),  # but no longer than ten budgets
        (0.1, 20),
    ],
)
def test_a_cell_ends_when_its_budget_is_spent(world, seconds, trials):
    cell = world.run(seconds)
    assert (cell.trials, cell.independent_trials) == (trials, trials)


def test_a_complete_matcher_goes_on(world):
    cell = world.run(11.0, complete=True)
    assert (cell.trials, cell.independent_trials) == (20, 20)
    quick = world.run(11.0, plan=replace(QUICK_PLAN, budget_s=10.0), complete=True)
    assert (quick.trials, quick.independent_trials) == (1, 1)


@pytest.mark.parametrize("stopped_from", [1, 0])
def test_a_match_that_is_stopped_counts_as_none_and_the_first_leaves_no_cell(world, stopped_from):
    def answer(_):
        if len(world.made) > stopped_from:
            raise StoppedError
        return world.truth()

    if stopped_from:
        cell = world.run(2.0, answer)
        assert (cell.outcomes, cell.false_positives, cell.stopped) == ("10000", 0, 9)
    else:
        with pytest.raises(StoppedError):
            world.run(11.0, answer)


def test_a_case_has_t_rho_lambda_and_bounds_and_no_garbage_is_collected(world):
    cases = []

    def noted(case):
        if world.made:
            cases.append((case, gc.isenabled()))
        return NO_MATCH

    world.run(answer=noted, plan=replace(PLAN, trials=1))
    assert gc.isenabled()
    for (case, on), steps in zip(cases, (PLAN.genuine_steps, PLAN.independent_steps), strict=True):
        assert not on
        assert (case.rho, case.lambda_) == (0.95, 0.428)
        assert case.tolerance == pytest.approx(0.214)
        assert (case.max_steps, case.limit_s) == (steps, PLAN.budget_s)


def test_independent_pairs_may_be_fewer(world):
    cell = world.run(plan=replace(PLAN, trials=6, independent_trials=2))
    assert (cell.trials, cell.independent_trials) == (6, 2)

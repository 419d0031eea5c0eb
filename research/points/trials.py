"""Try matchers on random point sets: genuine and independent pairs, and the time that they take.

A condition of the experiment and a matcher make a cell.

- A genuine pair is recognised (a true positive) where the matcher finds a transform, its image of
  every point of P is within t of the true one, and at least 80 % of the true pairs are found.
- An independent pair is a false positive where the matcher finds a transform.

A match is timed from the bare arrays, triangulations included, with Python's garbage collection
off. The time is processor time, which excludes other work on the machine; all matchers run in one
thread. After the genuine matches of a cell, scipy's Delaunay triangulations of the same sets are
timed in the same way: each in a batch of its own.
"""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass
from statistics import fmean, median
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from research.points.conditions import make_pair
from research.points.matchers import PointCase, StoppedError
from research.points.random_sets import random_pair
from research.points.results import PointCell

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.pointset.geometry.point_match import PointMatch
    from research.points.conditions import Condition
    from research.points.matchers import BenchMatcher
    from research.points.random_sets import RandomPair

    Clock = Callable[[], float]

Result = TypeVar("Result")

RECOGNISED_SHARE: Final = 0.8  # of the true pairs, that must be found
_FEWEST_MAY_TAKE: Final = 10.0  # budgets
_MS: Final = 1e3


@dataclass(frozen=True, slots=True)
class TrialPlan:
    """Set the number and the effort of the trials of a cell.

    After `budget_s` seconds a cell tries no further genuine pair, and after as many more no further
    independent pair; but `fewest_trials` pairs are tried for up to ten times as long. The steps
    bound a matcher's work on one pair of a kind, for matchers that count it; a search without a
    match takes all of them. With `exempt_complete`, matchers that are `complete` run all trials.
    """

    trials: int = 100
    seed: int = 0
    budget_s: float = 20.0
    fewest_trials: int = 5
    genuine_steps: int = 1_000_000_000
    independent_steps: int = 200_000_000
    exempt_complete: bool = True
    independent_trials: int | None = None  # None for as many as genuine ones

    def number_of_trials(self, *, genuine: bool) -> int:
        """Return the most pairs of a kind that a cell tries."""
        independent = self.independent_trials
        return self.trials if genuine or independent is None else independent


# For a run of a minute: fewer pairs, less work, and no rows with more points of P.
QUICK_PLAN: Final = TrialPlan(
    trials=5,
    budget_s=0.15,
    fewest_trials=1,
    genuine_steps=5_000_000,
    independent_steps=5_000_000,
    exempt_complete=False,
)
QUICK_LARGEST_M: Final = 100


def is_recognised(match: PointMatch | None, pair: RandomPair) -> bool:
    """Return whether a match of a genuine pair is true; see the module."""
    if match is None or match.transform is None or pair.transform is None:
        return False
    apart = match.transform.apply(pair.p) - pair.transform.apply(pair.p)
    true_pairs = set(map(tuple, pair.pairs.tolist()))
    recovered = true_pairs.intersection(map(tuple, match.pairs.tolist()))
    in_place = float(np.hypot(*apart.T).max()) <= pair.tolerance
    return in_place and len(recovered) >= RECOGNISED_SHARE * len(true_pairs)


def run_cell(
    condition: Condition, matcher: BenchMatcher, plan: TrialPlan, clock: Clock = time.process_time
) -> PointCell:
    """Try a matcher on the pairs of one condition; `clock` returns the time in seconds."""
    stopwatch = _Stopwatch(condition, matcher, plan, clock)
    stopwatch.warm_up()
    genuine = stopwatch.run(genuine=True)
    if genuine.stopped and len(genuine.answers) == 1:
        raise StoppedError
    scipy_s = stopwatch.triangulate(len(genuine.answers))
    independent = stopwatch.run(genuine=False)
    return PointCell(
        condition=condition,
        matcher=matcher.name,
        outcomes="".join("01"[answer] for answer in genuine.answers),
        false_positives=sum(independent.answers),
        independent_trials=len(independent.answers),
        stopped=genuine.stopped + independent.stopped,
        time_ms=_MS * median(genuine.match_s),
        independent_time_ms=_MS * median(independent.match_s),
        scipy_delaunay_ms=_MS * median(scipy_s),
        first_ms=_MS * genuine.match_s[0],
        mean_ms=_MS * fmean(genuine.match_s),
        independent_mean_ms=_MS * fmean(independent.match_s),
    )


@dataclass(slots=True)
class _Runs:
    """Collect the trials of one kind."""

    answers: list[bool]
    match_s: list[float]
    stopped: int = 0


@dataclass(frozen=True, slots=True)
class _Stopwatch:
    """Run trials of one cell against the clock."""

    condition: Condition
    matcher: BenchMatcher
    plan: TrialPlan
    clock: Clock

    def warm_up(self) -> None:
        """Match a few points, so that no trial includes the import of libraries."""
        setting, model = self.condition.parameters.setting, self.condition.model
        case = self._case(random_pair(10, 20, *setting, model=model, rng=self.plan.seed))
        _triangulate_both(case)
        self._timed(self.matcher.find, case)

    def run(self, *, genuine: bool) -> _Runs:
        """Run the trials of one kind until all are done or the budget is spent."""
        runs = _Runs([], [])
        start = self.clock()
        for trial in range(self.plan.number_of_trials(genuine=genuine)):
            pair = make_pair(self.condition, self.plan.seed, trial, genuine=genuine)
            self._try(pair, runs)
            hopeless = genuine and trial == 0 and runs.stopped > 0
            if hopeless or self._is_spent(runs, self.clock() - start):
                break
        return runs

    def triangulate(self, trials: int) -> list[float]:
        """Return the seconds that scipy takes for both sets of the first genuine pairs."""
        pairs = (make_pair(self.condition, self.plan.seed, k, genuine=True) for k in range(trials))
        return [self._timed(_triangulate_both, self._case(pair))[1] for pair in pairs]

    def _is_spent(self, runs: _Runs, seconds: float) -> bool:
        if self.matcher.complete and self.plan.exempt_complete:
            return False
        budget = self.plan.budget_s
        enough = len(runs.answers) >= self.plan.fewest_trials
        return seconds >= (budget if enough else _FEWEST_MAY_TAKE * budget)

    def _try(self, pair: RandomPair, runs: _Runs) -> None:
        match, seconds = self._timed(self.matcher.find, self._case(pair))
        runs.match_s.append(seconds)
        runs.stopped += match is None
        matched = match is not None and match.transform is not None
        runs.answers.append(matched if pair.transform is None else is_recognised(match, pair))

    def _case(self, pair: RandomPair) -> PointCase:
        plan, row = self.plan, self.condition.parameters
        steps = plan.independent_steps if pair.transform is None else plan.genuine_steps
        given = pair.p, pair.q, pair.tolerance, row.rho, row.lambda_
        return PointCase(*given, max_steps=steps, limit_s=plan.budget_s)

    def _timed(
        self, call: Callable[[PointCase], Result], case: PointCase
    ) -> tuple[Result | None, float]:
        """Return the result, None if the call was stopped, and the seconds that it took."""
        was_on = gc.isenabled()
        gc.disable()
        start = self.clock()
        try:
            result = call(case)
        except StoppedError:
            return None, self.clock() - start
        else:
            return result, self.clock() - start
        finally:
            if was_on:
                gc.enable()


def _triangulate_both(case: PointCase) -> None:
    from scipy.spatial import Delaunay  # noqa: PLC0415

    Delaunay(case.p)
    Delaunay(case.q)

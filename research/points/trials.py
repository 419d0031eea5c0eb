"""Try matchers on random point sets: genuine and independent pairs, and the time that they take.

A condition of the experiment and a matcher make a cell.

- A genuine pair is recognised (a true positive) where the matcher finds a transform, its image of
  every point of P is within t of the true one, and at least 80 % of the true pairs are found.
- An independent pair is a false positive where the matcher finds a transform.

A match is timed from the bare arrays, triangulations included, with Python's garbage collection
off. The time is processor time, which excludes other work on the machine; all matchers run in one
thread.
"""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass
from statistics import fmean
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from research.points.conditions import make_pair
from research.points.matchers import MATCHERS, PointCase
from research.points.random_sets import random_pair

if TYPE_CHECKING:
    from fpmatch.pointset.geometry.point_match import PointMatch
    from research.points.conditions import Condition
    from research.points.random_sets import RandomPair

RECOGNISED_SHARE: Final = 0.8  # of the true pairs, that must be found
COMPLETE: Final = "triangles"
"""The matcher that tries all pairs, however long that takes."""
_FEWEST_MAY_TAKE: Final = 10.0  # budgets


@dataclass(frozen=True, slots=True)
class TrialPlan:
    """Set the number and the effort of the trials of a cell.

    After `budget_s` seconds a cell tries no further genuine pair, and after as many more no further
    independent pair; but `fewest_trials` pairs are tried for up to ten times as long. The steps
    bound a matcher's work on one pair of a kind, for matchers that count it; a search without a
    match takes all of them.
    """

    trials: int = 100
    independent_trials: int = 20
    seed: int = 0
    budget_s: float = 0.7
    fewest_trials: int = 5
    genuine_steps: int = 1_000_000_000
    independent_steps: int = 200_000_000


# For a run of a minute: fewer pairs, less work, and no rows with more points of P.
QUICK_PLAN: Final = TrialPlan(5, 5, 0, 0.15, 1, 5_000_000, 5_000_000)
QUICK_LARGEST_M: Final = 100


def is_recognised(match: PointMatch, pair: RandomPair) -> bool:
    """Return whether a match of a genuine pair is true; see the module."""
    if match.transform is None or pair.transform is None:
        return False
    apart = match.transform.apply(pair.p) - pair.transform.apply(pair.p)
    true_pairs = set(map(tuple, pair.pairs.tolist()))
    recovered = true_pairs.intersection(map(tuple, match.pairs.tolist()))
    in_place = float(np.hypot(*apart.T).max()) <= pair.tolerance
    return in_place and len(recovered) >= RECOGNISED_SHARE * len(true_pairs)


def run_cell(condition: Condition, matcher: str, plan: TrialPlan) -> dict[str, Any]:
    """Try a matcher on the pairs of one condition; return the cell as the file has it."""
    setting, model = condition.parameters.setting, condition.model
    warm_up = random_pair(10, 20, *setting, model=model, rng=plan.seed)  # imports are not timed
    _match(warm_up, condition, matcher, plan)
    genuine, seconds = _run(condition, matcher, plan, genuine=True)
    independent, _ = _run(condition, matcher, plan, genuine=False)
    return {
        "model": model,
        "matcher": matcher,
        "row": condition.row,
        "factor": condition.factor,
        "trials": len(genuine),
        "true_positives": sum(genuine),
        "independent_trials": len(independent),
        "false_positives": sum(independent),
        "mean_ms": round(1e3 * fmean(seconds), 4),
        "first_ms": round(1e3 * seconds[0], 4),
    }


def _run(
    condition: Condition, matcher: str, plan: TrialPlan, *, genuine: bool
) -> tuple[list[bool], list[float]]:
    """Run the trials of one kind until all are done or the budget is spent."""
    answers: list[bool] = []
    seconds: list[float] = []
    for trial in range(plan.trials if genuine else plan.independent_trials):
        pair = make_pair(condition, plan.seed, trial, genuine=genuine)
        match, took = _match(pair, condition, matcher, plan)
        seconds.append(took)
        answers.append(is_recognised(match, pair) if genuine else match.transform is not None)
        enough = len(answers) >= plan.fewest_trials
        spent = sum(seconds) >= plan.budget_s * (1.0 if enough else _FEWEST_MAY_TAKE)
        if spent and matcher != COMPLETE:
            break
    return answers, seconds


def _match(
    pair: RandomPair, condition: Condition, matcher: str, plan: TrialPlan
) -> tuple[PointMatch, float]:
    """Return the match of a pair, and the seconds that it took."""
    row = condition.parameters
    steps = plan.independent_steps if pair.transform is None else plan.genuine_steps
    case = PointCase(pair.p, pair.q, pair.tolerance, row.rho, row.lambda_, steps)
    was_on = gc.isenabled()
    gc.disable()
    start = time.process_time()
    try:
        match = MATCHERS[matcher](case)
    finally:
        seconds = time.process_time() - start
        if was_on:
            gc.enable()
    return match, seconds

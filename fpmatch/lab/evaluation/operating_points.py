"""The FNMR at chosen false match rates, with thresholds and intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.lab.evaluation.rates.bootstrap import DEFAULT_BOOTSTRAP, bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import POOLED, fnmr_at_fmr, threshold_at_fmr
from fpmatch.lab.evaluation.rates.intervals import (
    ExactBound,
    Interval,
    drawn_or_exact,
    enough_for_interval,
    exact_bound,
    interval_of,
)
from fpmatch.lab.evaluation.report.results import split_scores

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """The FNMR of a database at the lowest threshold with at most the false match rate `fmr`.

    `threshold` is the least score that matches, of distances the greatest; None where no pair
    matches. `fnmr` is None where there are too few impostor pairs, `interval`, the 95 % interval of
    the FNMR, where there are too few fingers. `bound` is its basis where it has one limit.
    """

    name: str
    fmr: float
    fnmr: float | None
    threshold: float | None
    interval: Interval | None
    bound: ExactBound | None = None


def operating_points(
    report: RatesReport,
    fmrs: Sequence[float],
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
) -> list[OperatingPoint]:
    """Return the operating points of each database, and of all scores pooled, at each FMR.

    The bootstrap draws as for `fpmatch.lab.evaluation.rates.intervals.rate_intervals`.
    """
    if not fmrs:
        return []
    trials = [row.scores.trials for row in report.sets]
    draws = bootstrap_rates(trials, bootstrap, seed, fmrs) if bootstrap else None
    found = []
    for k, row in enumerate(report.sets):
        found += _points(row.name, [row], fmrs, draws.sets[k] if draws else None)
    return found + _points(POOLED, report.sets, fmrs, draws.pooled if draws else None)


def _points(
    name: str, sets: Sequence[SetRates], fmrs: Sequence[float], draws: NDArray[np.float64] | None
) -> list[OperatingPoint]:
    trials, scores = [row.scores.trials for row in sets], split_scores(sets)
    enough = all(map(enough_for_interval, trials))
    every = np.unique(np.concatenate(scores))
    points = []
    for column, fmr in enumerate(fmrs, start=1):
        fnmr, threshold, interval, bound = fnmr_at_fmr(*scores, fmr), None, None, None
        highest = threshold_at_fmr(scores[1], fmr)
        if fnmr is not None and highest is not None:
            above = every[np.searchsorted(every, highest, side="right") :]
            sign = -1 if sets[0].scores.distances else 1
            threshold = sign * float(above[0]) if above.size else None
            if draws is not None:
                drawn = interval_of(draws[:, column]) if enough else None
                interval, bound = drawn_or_exact(fnmr, drawn, exact_bound("fnmr", trials))
        points.append(OperatingPoint(name, fmr, fnmr, threshold, interval, bound))
    return points

"""The 95 % intervals of an evaluation's rates, and its FNMR at chosen false match rates."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.lab.evaluation.rates.bootstrap import (
    BOOTSTRAPPED,
    DEFAULT_BOOTSTRAP,
    bootstrap_rates,
    draw_fingers,
)
from fpmatch.lab.evaluation.rates.error_rates import POOLED, fnmr_at_fmr, threshold_at_fmr
from fpmatch.lab.evaluation.rates.intervals import (
    CONFIDENCE,
    ExactBound,
    Interval,
    drawn_or_exact,
    enough_for_interval,
    exact_bound,
    interval_of,
)
from fpmatch.lab.evaluation.report.results import split_scores

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.error_rates import Rates
    from fpmatch.lab.evaluation.rates.scores_set import Trials
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates


@dataclass(frozen=True, slots=True)
class RateIntervals:
    """The interval of each rate; None where there is no rate or no interval.

    ZeroFMR and ZeroFNMR have none: each depends on one extreme score, which the bootstrap cannot
    vary. `bounds` has the basis of those intervals that are not of the bootstrap, by rate.
    """

    eer: Interval | None = None
    fmr100: Interval | None = None
    fmr1000: Interval | None = None
    fmr10000: Interval | None = None
    rank_one: Interval | None = None
    bounds: Mapping[str, ExactBound] = field(default_factory=dict)

    def of(self, rate: str) -> tuple[Interval | None, ExactBound | None]:
        """Return the interval of the rate of this name, and its basis where it has one limit."""
        return getattr(self, rate, None), self.bounds.get(rate)


@dataclass(frozen=True, slots=True)
class ReportIntervals:
    """The intervals of a `RatesReport`, and number and seed of bootstrap replicates."""

    bootstrap: int
    seed: int
    sets: tuple[RateIntervals, ...]
    mean: RateIntervals
    pooled: RateIntervals

    def as_json(self) -> dict[str, Any]:
        """Return the intervals as JSON values, pairs of limits by name."""
        return {"confidence": CONFIDENCE, "method": "bootstrap", **asdict(self)}


def rate_intervals(
    report: RatesReport, *, bootstrap: int = DEFAULT_BOOTSTRAP, seed: int = 0
) -> ReportIntervals:
    """Estimate 95 % intervals of an evaluation's rates.

    The interval leaves out 2.5 % of the bootstrap replicates on either side. It describes how the
    rates scatter with other fingers on the same sensor. With ten fingers it is rough, and with
    fewer than `MIN_FINGERS` in a database there is none. A rate of 0 or 1 has one limit, for any
    number of fingers; see `exact_bound`. Where the fingers are not known, comparisons are drawn.
    """
    trials = [row.scores.trials for row in report.sets]
    replicates = bootstrap_rates(trials, bootstrap, seed)
    ranks = [_rank_one(row, bootstrap, seed, k) for k, row in enumerate(report.sets)]
    sets = tuple(
        _rate_intervals(row.rates, row.rank_one, [trials[k]], replicates.sets[k], ranks[k])
        for k, row in enumerate(report.sets)
    )
    known = [rank for rank in ranks if rank is not None]
    hits = np.sum(known, axis=0) if len(known) == len(ranks) else None
    mean = _rate_intervals(report.mean, None, trials, replicates.mean, None, mean=True)
    pooled = _rate_intervals(report.pooled, report.rank_one, trials, replicates.pooled, hits)
    return ReportIntervals(bootstrap, seed, sets, mean, pooled)


def _rank_one(
    row: SetRates, bootstrap: int, seed: int, set_index: int
) -> NDArray[np.float64] | None:
    """Return hits and probes of each draw, (2, draws); the drawn are searched among all fingers."""
    if row.identification is None:
        return None
    counts = draw_fingers(row.identification.fingers, bootstrap, seed, set_index)
    weights = np.take(counts, row.identification.finger, axis=1)
    first = row.identification.rank == 1
    return np.stack([weights @ first, weights.sum(axis=1)]).astype(np.float64)


def _rate_intervals(
    rates: Rates,
    rank_one: float | None,
    trials: Sequence[Trials],
    draws: NDArray[np.float64],
    ranks: NDArray[np.float64] | None,
    *,
    mean: bool = False,
) -> RateIntervals:
    """Return the intervals of the rates of databases pooled, or of their mean."""
    drawn: dict[str, Interval | None] = {}
    if all(map(enough_for_interval, trials)):
        drawn = {name: interval_of(draws[:, k]) for k, name in enumerate(BOOTSTRAPPED)}
        if ranks is not None:
            with np.errstate(invalid="ignore"):  # a draw without probes has no rate
                drawn["rank_one"] = interval_of(ranks[0] / ranks[1])
    intervals: dict[str, Interval | None] = {}
    bounds = {}
    for name in (*BOOTSTRAPPED, "rank_one"):
        rate = rank_one if name == "rank_one" else getattr(rates, name)
        if rate is None:
            continue
        exact = exact_bound(name, trials, mean=mean) if rate in {0.0, 1.0} else None
        intervals[name], used = drawn_or_exact(rate, drawn.get(name), exact)
        if used is not None:
            bounds[name] = used
    return RateIntervals(**intervals, bounds=bounds)


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
    report: RatesReport, fmrs: Sequence[float], *, bootstrap: int = DEFAULT_BOOTSTRAP, seed: int = 0
) -> list[OperatingPoint]:
    """Return the operating points of each database, and of all scores pooled, at each FMR.

    The bootstrap draws as for `rate_intervals`.
    """
    if not fmrs:
        return []
    trials = [row.scores.trials for row in report.sets]
    draws = bootstrap_rates(trials, bootstrap, seed, fmrs) if bootstrap else None
    points = []
    for k, row in enumerate(report.sets):
        points += _points(row.name, [row], fmrs, draws.sets[k] if draws else None)
    return points + _points(POOLED, report.sets, fmrs, draws.pooled if draws else None)


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

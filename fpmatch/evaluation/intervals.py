"""95 % intervals of the rates of an evaluation, by the bootstrap over fingers."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.evaluation.bootstrap import (
    BOOTSTRAPPED,
    DEFAULT_BOOTSTRAP,
    bootstrap_rates,
    draw_fingers,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.evaluation.ranked_trials import Trials
    from fpmatch.evaluation.rates import Rates
    from fpmatch.evaluation.report import RatesReport, SetRates

MIN_FINGERS: Final = 5  # of a database
MIN_COMPARISONS: Final = 10  # of a kind, where the fingers are not known
CONFIDENCE: Final = 0.95


class Interval(NamedTuple):
    """The limits between which a rate lies, as fractions."""

    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        """Whether zero lies outside."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True, slots=True)
class RateIntervals:
    """Hold the interval of each rate; None where there is no rate or no interval.

    ZeroFMR and ZeroFNMR have none: each depends on one extreme score, which the bootstrap cannot
    vary.
    """

    eer: Interval | None = None
    fmr100: Interval | None = None
    fmr1000: Interval | None = None
    fmr10000: Interval | None = None
    rank_one: Interval | None = None


@dataclass(frozen=True, slots=True)
class ReportIntervals:
    """Hold the intervals of a `RatesReport`, and number and seed of bootstrap replicates."""

    bootstrap: int
    seed: int
    sets: tuple[RateIntervals, ...]
    mean: RateIntervals
    pooled: RateIntervals

    def as_json(self) -> dict[str, Any]:
        """Return the intervals as JSON values, pairs of limits by name."""
        return {"confidence": CONFIDENCE, **asdict(self)}


def rate_intervals(
    report: RatesReport, *, bootstrap: int = DEFAULT_BOOTSTRAP, seed: int = 0
) -> ReportIntervals:
    """Estimate 95 % intervals of an evaluation's rates.

    The interval leaves out 2.5 % of the bootstrap replicates on either side. It describes how the
    rates scatter with other fingers on the same sensor. With ten fingers it is rough, with fewer
    than `MIN_FINGERS` in a database there is none, and where no error was seen it is 0 to 0, which
    does not mean that there are none. Where the fingers are not known, comparisons are drawn.
    """
    trials = [row.scores.trials for row in report.sets]
    replicates = bootstrap_rates(trials, bootstrap, seed)
    enough = [enough_for_interval(t) for t in trials]
    ranks = [_rank_one(row, bootstrap, seed, k) for k, row in enumerate(report.sets)]
    sets = tuple(
        _rate_intervals(row.rates, replicates.sets[k], ranks[k]) if enough[k] else RateIntervals()
        for k, row in enumerate(report.sets)
    )
    mean = pooled = RateIntervals()
    if all(enough):
        known = [rank for rank in ranks if rank is not None]
        mean = _rate_intervals(report.mean, replicates.mean, None)
        hits = np.sum(known, axis=0) if len(known) == len(ranks) else None
        pooled = _rate_intervals(report.pooled, replicates.pooled, hits)
    return ReportIntervals(bootstrap, seed, sets, mean, pooled)


def enough_for_interval(trials: Trials) -> bool:
    """Return whether there are enough fingers or, where they are not known, comparisons."""
    if trials.fingers:
        return trials.fingers >= MIN_FINGERS
    genuine = int(trials.genuine.sum())
    return min(genuine, trials.genuine.size - genuine) >= MIN_COMPARISONS


def interval_of(draws: NDArray[np.float64]) -> Interval | None:
    """Return the limits that leave out 2.5 % of the draws on either side.

    Draws without a rate are NaN; where these are half of them or more, there is no interval.
    """
    known = draws[np.isfinite(draws)]
    if known.size <= draws.size / 2:
        return None
    low, high = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(float(low), float(high))


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
    rates: Rates, draws: NDArray[np.float64], ranks: NDArray[np.float64] | None
) -> RateIntervals:
    found = {
        name: interval_of(draws[:, column])
        for column, name in enumerate(BOOTSTRAPPED)
        if getattr(rates, name) is not None
    }
    if ranks is not None:
        with np.errstate(invalid="ignore"):  # a draw without probes has no rate
            found["rank_one"] = interval_of(ranks[0] / ranks[1])
    return RateIntervals(**found)

"""Analysis of error rates: their intervals, FNMR at chosen FMRs, and comparison with other runs.

`Report` is the value that is written as text, JSON and page.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.rates.bootstrap import (
    BOOTSTRAPPED,
    DEFAULT_BOOTSTRAP,
    bootstrap_rates,
    draw_fingers,
)
from fpmatch.lab.evaluation.rates.error_rates import POOLED, fnmr_at_fmr, threshold_at_fmr
from fpmatch.lab.evaluation.rates.intervals import (
    BOOTSTRAP,
    CONFIDENCE,
    bound_json,
    interval_json,
    rate_interval,
)
from fpmatch.lab.evaluation.rates.run_comparison import common_pairs, compare_runs
from fpmatch.lab.evaluation.rates.scores import choose_matcher
from fpmatch.lab.evaluation.report.results import split_scores

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.intervals import Interval
    from fpmatch.lab.evaluation.rates.run_comparison import RunComparison
    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

    Intervals = Mapping[str, Interval | None]

WITH_INTERVALS: Final = (*BOOTSTRAPPED, "rank_one")
"""The rates that have an interval; ZeroFMR and ZeroFNMR depend on one extreme score each."""


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """The FNMR of a database at the lowest threshold with at most the false match rate `fmr`.

    `threshold` is the least score that matches, of distances the greatest; None where no pair
    matches. `fnmr` is None where there are too few impostor pairs, `interval`, the 95 % interval of
    the FNMR, where there are too few fingers.
    """

    name: str
    fmr: float
    fnmr: float | None
    threshold: float | None
    interval: Interval | None

    def as_json(self) -> dict[str, Any]:
        """Return the point as JSON values."""
        return {
            "name": self.name,
            "fmr": self.fmr,
            "fnmr": self.fnmr,
            "threshold": self.threshold,
            "interval": interval_json(self.interval),
            "bound": bound_json(self.interval),
        }


@dataclass(frozen=True, slots=True)
class Analysis:
    """One matcher's rates, their 95 % intervals, and the comparison with a baseline.

    `intervals` has those of each of `WITH_INTERVALS`, by database, then of the mean and of all
    scores pooled; it is empty without a bootstrap. `points` are the FNMR at chosen FMRs.
    """

    report: RatesReport
    bootstrap: int
    seed: int
    intervals: tuple[Intervals, ...] = ()
    points: tuple[OperatingPoint, ...] = ()
    baseline: RunComparison | None = None
    baseline_name: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        document = {"matcher": self.report.matcher, **self.report.as_json()}
        if self.intervals:
            *sets, mean, pooled = map(_intervals_json, self.intervals)
            document["intervals"] = {
                "confidence": CONFIDENCE,
                "method": BOOTSTRAP,
                "bootstrap": self.bootstrap,
                "seed": self.seed,
                "sets": sets,
                "mean": mean,
                "pooled": pooled,
            }
        if self.baseline is not None:
            document["baseline"] = self.baseline.as_json()
        if self.points:
            document["fnmr_at_fmr"] = [one.as_json() for one in self.points]
        return document


def _intervals_json(intervals: Intervals) -> dict[str, Any]:
    bounds = {name: bound_json(one) for name, one in intervals.items() if bound_json(one)}
    return {**{name: interval_json(one) for name, one in intervals.items()}, "bounds": bounds}


@dataclass(frozen=True, slots=True)
class Report:
    """The report of a run: analyses, one a matcher, and the first compared with each other one."""

    analyses: tuple[Analysis, ...]
    comparisons: tuple[RunComparison, ...] = ()

    @classmethod
    def of(
        cls,
        results: Sequence[RatesReport],
        *,
        bootstrap: int = DEFAULT_BOOTSTRAP,
        seed: int = 0,
        **options: Any,
    ) -> Report:
        """Analyse results as `analyse` does, and compare the first with the others.

        Matchers without pairs in common with it, or without names of prints, are not compared.
        """
        draws: dict[str, Any] = {"bootstrap": bootstrap, "seed": seed}
        analyses = tuple(analyse(one, **draws, **options) for one in results)
        first, *others = (one.scores for one in results)
        compared = [other for other in others if common_pairs(first, other)]
        return cls(analyses, tuple(compare_runs(first, other, **draws) for other in compared))

    def as_json(self) -> dict[str, Any]:
        """Return the report as one JSON object."""
        each = [one.as_json() for one in self.analyses]
        if len(each) == 1:
            return each[0]
        against = [comparison.as_json() for comparison in self.comparisons]
        return {"matchers": each, "against_first": against}


def analyse(
    report: RatesReport,
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
    fmrs: Sequence[float] = (),
    baseline: Sequence[ScoresSet] | None = None,
    baseline_name: str = "the baseline",
) -> Analysis:
    """Analyse the rates of a matcher.

    `bootstrap` is the number of replicates for the 95 % intervals (0: no intervals). With ten
    fingers an interval is rough, and with fewer than five in a database there is none. A rate of 0
    or 1 has one limit. `baseline` is an earlier run: its comparisons by the same matcher, or by its
    only one, are compared. `fmrs` are false match rates at which the FNMR is reported.
    """
    draws = None
    if bootstrap:
        draws = bootstrap_rates([one.trials for one in report.scores], bootstrap, seed)
    return Analysis(
        report,
        bootstrap,
        seed,
        () if draws is None else tuple(_all_intervals(report, draws, bootstrap, seed)),
        tuple(_operating_points(report, fmrs, bootstrap, seed)),
        None if baseline is None else _against(baseline, baseline_name, report, bootstrap, seed),
        baseline_name,
    )


def _against(
    baseline: Sequence[ScoresSet], name: str, report: RatesReport, bootstrap: int, seed: int
) -> RunComparison:
    """Compare with the run of a file of this name."""
    earlier = list(baseline)
    if len({one.matcher for one in earlier}) > 1:
        earlier = choose_matcher(earlier, report.matcher, name)
    if len(earlier) == len(report.sets) == 1 and earlier[0].name == Path(name).stem:
        earlier = [replace(earlier[0], name=report.sets[0].name)]  # named after its file only
    return compare_runs(earlier, report.scores, bootstrap=bootstrap, seed=seed)


def _all_intervals(
    report: RatesReport, draws: Any, bootstrap: int, seed: int
) -> list[dict[str, Interval | None]]:
    """Return the intervals of each database, of the mean, and of all scores pooled."""
    trials = [one.trials for one in report.scores]
    hits = [_rank_one_draws(row, bootstrap, seed, k) for k, row in enumerate(report.sets)]
    known = [one for one in hits if one is not None]
    together = np.sum(known, axis=0) if len(known) == len(hits) else None
    parts: list[Any] = [
        (row.rates, row.rank_one, draws.sets[k], hits[k], [trials[k]], False)
        for k, row in enumerate(report.sets)
    ]
    parts.append((report.mean, None, draws.mean, None, trials, True))
    parts.append((report.pooled, report.rank_one, draws.pooled, together, trials, False))
    intervals = []
    for rates, rank_one, of_rates, of_rank, some, mean in parts:
        of_part = {
            name: None
            if (rate := getattr(rates, name)) is None
            else rate_interval(name, rate, of_rates[:, k], some, mean=mean)
            for k, name in enumerate(BOOTSTRAPPED)
        }
        shares = None if of_rank is None else _shares(*of_rank)
        of_part["rank_one"] = (
            None if rank_one is None else rate_interval("rank_one", rank_one, shares, some)
        )
        intervals.append(of_part)
    return intervals


def _shares(hits: NDArray[np.float64], searches: NDArray[np.float64]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # a draw without probes has no rate
        return np.asarray(hits / searches)


def _rank_one_draws(
    row: SetRates, bootstrap: int, seed: int, set_index: int
) -> NDArray[np.float64] | None:
    """Return hits and probes of each draw, (2, draws); the drawn are searched among all fingers."""
    if row.ranks is None:
        return None
    rank, finger = row.ranks
    weights = draw_fingers(row.scores.trials.fingers, bootstrap, seed, set_index)[:, finger]
    return np.stack([weights @ (rank == 1), weights.sum(axis=1)]).astype(np.float64)


def _operating_points(
    report: RatesReport, fmrs: Sequence[float], bootstrap: int, seed: int
) -> list[OperatingPoint]:
    """Return the operating points of each database, and of several all, at each FMR."""
    if not fmrs:
        return []
    trials = [one.trials for one in report.scores]
    draws = bootstrap_rates(trials, bootstrap, seed, fmrs) if bootstrap else None
    parts: list[tuple[str, Sequence[SetRates], Any]] = [
        (row.name, [row], None if draws is None else draws.sets[k])
        for k, row in enumerate(report.sets)
    ]
    if len(report.sets) > 1:
        parts.append((POOLED, report.sets, None if draws is None else draws.pooled))
    points = []
    for name, sets, of_part in parts:
        scores = split_scores(sets)
        every = np.unique(np.concatenate(scores))
        sign = -1 if sets[0].scores.distances else 1
        for column, fmr in enumerate(fmrs, start=1):
            fnmr, threshold, interval = fnmr_at_fmr(*scores, fmr), None, None
            highest = threshold_at_fmr(scores[1], fmr)
            if fnmr is not None and highest is not None:
                above = every[np.searchsorted(every, highest, side="right") :]
                threshold = sign * float(above[0]) if above.size else None
                if of_part is not None:
                    some = [row.scores.trials for row in sets]
                    interval = rate_interval("fnmr", fnmr, of_part[:, column], some)
            points.append(OperatingPoint(name, fmr, fnmr, threshold, interval))
    return points

"""The FNMR at chosen false match rates, with thresholds and intervals."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.evaluation.bootstrap import DEFAULT_BOOTSTRAP, bootstrap_rates
from fpmatch.evaluation.error_vs_discard import POOLED
from fpmatch.evaluation.intervals import Interval, enough_for_interval, interval_of
from fpmatch.evaluation.rates import fnmr_at_fmr, threshold_at_fmr
from fpmatch.evaluation.report import split_scores

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.report import RatesReport


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """Hold the FNMR of a database at the lowest threshold with at most the false match rate `fmr`.

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
        """Return the point as JSON values; rates as fractions."""
        return asdict(self)


def operating_points(
    report: RatesReport,
    fmrs: Sequence[float],
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
) -> list[OperatingPoint]:
    """Return the operating points of each database, and of all scores pooled, at each FMR.

    The bootstrap draws as for `fpmatch.evaluation.intervals.rate_intervals`.
    """
    if not fmrs:
        return []
    trials = [row.scores.trials for row in report.sets]
    enough = [enough_for_interval(t) for t in trials]
    draws = bootstrap_rates(trials, bootstrap, seed, fmrs) if bootstrap else None
    distances = report.sets[0].scores.distances
    found = []
    for k, row in enumerate(report.sets):
        of_set = draws.sets[k] if draws and enough[k] else None
        found += _points(row.name, row.scores.split(), fmrs, of_set, distances=distances)
    of_all = draws.pooled if draws and all(enough) else None
    return found + _points(POOLED, split_scores(report.sets), fmrs, of_all, distances=distances)


def _points(
    name: str,
    scores: tuple[NDArray[np.float64], NDArray[np.float64]],
    fmrs: Sequence[float],
    draws: NDArray[np.float64] | None,
    *,
    distances: bool,
) -> list[OperatingPoint]:
    every = np.unique(np.concatenate(scores))
    points = []
    for column, fmr in enumerate(fmrs, start=1):
        fnmr, threshold, interval = fnmr_at_fmr(*scores, fmr), None, None
        highest = threshold_at_fmr(scores[1], fmr) if fnmr is not None else None
        if highest is not None:
            above = every[np.searchsorted(every, highest, side="right") :]
            threshold = float(-above[0] if distances else above[0]) if above.size else None
            interval = None if draws is None else interval_of(draws[:, column])
        points.append(OperatingPoint(name, fmr, fnmr, threshold, interval))
    return points

"""The report of a run as one JSON document, of which text, tables and page are made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.batch.decision import calibration_of
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
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.bootstrap import Replicates
    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

WITH_INTERVALS: Final = (*BOOTSTRAPPED, "rank_one")
"""The rates that have an interval; ZeroFMR and ZeroFNMR depend on one extreme score each."""


def report_document(
    results: Sequence[RatesReport],
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
    fmrs: Sequence[float] = (),
    baseline: Sequence[ScoresSet] | None = None,
    baseline_name: str = "the baseline",
) -> dict[str, Any]:
    """Return rates, their 95 % intervals, and the comparison with other runs as JSON values.

    `bootstrap` is the number of replicates for the intervals (0: no intervals). With ten fingers an
    interval is rough, and with fewer than five in a database there is none. A rate of 0 or 1 has
    one limit. `baseline` is an earlier run: its comparisons by the same matcher, or by its only
    one, are compared. `fmrs` are false match rates at which the FNMR is reported. Of several
    matchers the first is compared with each other one that has pairs in common with it.
    """
    draws = {"bootstrap": bootstrap, "seed": seed}
    each = []
    for report in results:
        document = {"matcher": report.matcher, **report.as_json()}
        if bootstrap:
            document["intervals"] = _intervals(report, **draws)
        if baseline is not None:
            compared = _against(baseline, baseline_name, report, **draws)
            document["baseline"] = {"name": baseline_name, **compared}
        if fmrs:
            document["fnmr_at_fmr"] = _operating_points(report, fmrs, **draws)
        each.append(document)
    if len(each) == 1:
        return each[0]
    first, *others = (one.scores for one in results)
    against = [compare_runs(first, one, **draws) for one in others if common_pairs(first, one)]
    return {"matchers": each, "against_first": against}


def _against(
    baseline: Sequence[ScoresSet], name: str, report: RatesReport, **draws: int
) -> dict[str, Any]:
    """Compare with the run of a file of this name."""
    earlier = list(baseline)
    if len({one.matcher for one in earlier}) > 1:
        earlier = choose_matcher(earlier, report.matcher, name)
    if len(earlier) == len(report.sets) == 1 and earlier[0].name == Path(name).stem:
        earlier = [replace(earlier[0], name=report.sets[0].name)]  # named after its file only
    return compare_runs(earlier, report.scores, **draws)


def _intervals(report: RatesReport, bootstrap: int, seed: int) -> dict[str, Any]:
    """Return the intervals of each database, of the mean, and of all scores pooled."""
    trials = [one.trials for one in report.scores]
    draws = bootstrap_rates(trials, bootstrap, seed)
    hits = [_rank_one_draws(row, bootstrap, seed, k) for k, row in enumerate(report.sets)]
    known = [one for one in hits if one is not None]
    together = np.sum(known, axis=0) if len(known) == len(hits) else None
    figures = report.as_json()

    def intervals_of(
        rates: dict[str, Any],
        drawn: NDArray[np.float64],
        ranks: NDArray[np.float64] | None,
        some: Any,
        *,
        mean: bool = False,
    ) -> dict[str, Any]:
        columns = dict(zip(BOOTSTRAPPED, drawn.T, strict=True))
        if ranks is not None:
            with np.errstate(invalid="ignore"):  # a draw without probes has no rate
                columns["rank_one"] = ranks[0] / ranks[1]
        found = {
            name: None
            if rates.get(name) is None
            else rate_interval(name, rates[name], columns.get(name), some, mean=mean)
            for name in WITH_INTERVALS
        }
        bounds = {name: bound_json(one) for name, one in found.items() if bound_json(one)}
        return {**{name: interval_json(one) for name, one in found.items()}, "bounds": bounds}

    return {
        "confidence": CONFIDENCE,
        "method": BOOTSTRAP,
        "bootstrap": bootstrap,
        "seed": seed,
        "sets": [
            intervals_of(row, draws.sets[k], hits[k], [trials[k]])
            for k, row in enumerate(figures["sets"])
        ],
        "mean": intervals_of(figures["mean"], draws.mean, None, trials, mean=True),
        "pooled": intervals_of(figures["pooled"], draws.pooled, together, trials),
    }


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
) -> list[dict[str, Any]]:
    """Return the FNMR at the lowest threshold with at most each FMR, of each database and of all.

    The `threshold` is the least score that matches, of distances the greatest; None where no pair
    matches.
    """
    trials = [one.trials for one in report.scores]
    draws: Replicates | None = bootstrap_rates(trials, bootstrap, seed, fmrs) if bootstrap else None
    parts: list[tuple[str, Sequence[SetRates], Any]] = [
        (row.name, [row], draws and draws.sets[k]) for k, row in enumerate(report.sets)
    ]
    if len(report.sets) > 1:
        parts.append((POOLED, report.sets, draws and draws.pooled))
    calibration = calibration_of(report.matcher)
    points = []
    for name, sets, drawn in parts:
        scores = split_scores(sets)
        every = np.unique(np.concatenate(scores))
        for column, fmr in enumerate(fmrs, start=1):
            fnmr, interval, above = fnmr_at_fmr(*scores, fmr), None, every[:0]
            highest = threshold_at_fmr(scores[1], fmr)
            if fnmr is not None and highest is not None:
                above = every[np.searchsorted(every, highest, side="right") :]
                if drawn is not None:
                    some = [row.scores.trials for row in sets]
                    interval = rate_interval("fnmr", fnmr, drawn[:, column], some)
            sign = -1 if sets[0].scores.distances else 1
            threshold = sign * float(above[0]) if above.size else None
            score = None
            if calibration is not None and threshold is not None:
                score = calibration.score(threshold)
            points.append(
                {
                    "name": name,
                    "fmr": fmr,
                    "fnmr": fnmr,
                    "threshold": threshold,
                    "score": score,
                    "interval": interval_json(interval),
                    "bound": bound_json(interval),
                }
            )
    return points

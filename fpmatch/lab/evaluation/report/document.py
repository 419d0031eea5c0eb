"""The report of a run as one JSON document, of which text, tables and page are made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.batch.decision import calibration_of
from fpmatch.lab.evaluation.rates.bootstrap import (
    BOOTSTRAP,
    BOOTSTRAPPED,
    CONFIDENCE,
    DEFAULT_BOOTSTRAP,
    bootstrap_rates,
    bound_json,
    draw_fingers,
    interval_json,
    rate_interval,
)
from fpmatch.lab.evaluation.rates.error_rates import POOLED, fnmr_at_fmr, threshold_at_fmr
from fpmatch.lab.evaluation.rates.run_comparison import common_pairs, compare_runs
from fpmatch.lab.evaluation.rates.scores import choose_matcher
from fpmatch.lab.evaluation.report.results import split_scores

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.bootstrap import Replicates
    from fpmatch.lab.evaluation.rates.scores import ScoresSet, Trials
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
            document["intervals"] = _intervals(report, document, **draws)
        if baseline is not None:
            earlier = list(baseline)
            if len({one.matcher for one in earlier}) > 1:
                earlier = choose_matcher(earlier, report.matcher, baseline_name)
            if (
                len(earlier) == len(report.sets) == 1
                and earlier[0].name == Path(baseline_name).stem
            ):
                earlier = [replace(earlier[0], name=report.sets[0].name)]  # that of its file only
            compared = compare_runs(earlier, report.scores, **draws)
            document["baseline"] = {"name": baseline_name, **compared}
        if fmrs:
            document["fnmr_at_fmr"] = _operating_points(report, fmrs, **draws)
        each.append(document)
    if len(each) == 1:
        return each[0]
    first, *others = (one.scores for one in results)
    against = [compare_runs(first, one, **draws) for one in others if common_pairs(first, one)]
    return {"matchers": each, "against_first": against}


def _intervals(
    report: RatesReport, document: dict[str, Any], bootstrap: int, seed: int
) -> dict[str, Any]:
    """Return the intervals of each database, of the mean, and of all scores pooled."""
    trials = [one.trials for one in report.scores]
    draws = bootstrap_rates(trials, bootstrap, seed)
    hits = [_rank_one_draws(row, bootstrap, seed, k) for k, row in enumerate(report.sets)]
    known = [one for one in hits if one is not None]
    together = np.sum(known, axis=0) if len(known) == len(hits) else None
    return {
        "confidence": CONFIDENCE,
        "method": BOOTSTRAP,
        "bootstrap": bootstrap,
        "seed": seed,
        "sets": [
            _limits(row, draws.sets[k], hits[k], [trials[k]])
            for k, row in enumerate(document["sets"])
        ],
        "mean": _limits(document["mean"], draws.sets.mean(axis=0), None, trials, mean=True),
        "pooled": _limits(document["pooled"], draws.pooled, together, trials),
    }


def _limits(
    rates: dict[str, Any],
    draws: NDArray[np.float64],
    hits: NDArray[np.float64] | None,
    trials: Sequence[Trials],
    *,
    mean: bool = False,
) -> dict[str, Any]:
    """Return the intervals of the rates of some comparisons, of which `draws` and `hits` are."""
    columns = dict(zip(BOOTSTRAPPED, draws.T, strict=True))
    if hits is not None:
        with np.errstate(invalid="ignore"):  # a draw without probes has no rate
            columns["rank_one"] = hits[0] / hits[1]
    intervals = {
        name: rate_interval(name, rates.get(name), columns.get(name), trials, mean=mean)
        for name in WITH_INTERVALS
    }
    bounds = {name: bound for name, one in intervals.items() if (bound := bound_json(one))}
    return {**{name: interval_json(one) for name, one in intervals.items()}, "bounds": bounds}


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
        genuine, impostor = split_scores(sets)
        both = np.concatenate([genuine, impostor])
        sign = -1 if sets[0].scores.distances else 1
        for column, fmr in enumerate(fmrs, start=1):
            fnmr, highest = fnmr_at_fmr(genuine, impostor, fmr), threshold_at_fmr(impostor, fmr)
            interval = threshold = None
            if fnmr is not None and highest is not None:
                if (above := both[both > highest]).size:
                    threshold = sign * float(above.min())
                if drawn is not None:
                    of_sets = [row.scores.trials for row in sets]
                    interval = rate_interval("fnmr", fnmr, drawn[:, column], of_sets)
            points.append(
                {
                    "name": name,
                    "fmr": fmr,
                    "fnmr": fnmr,
                    "threshold": threshold,
                    "score": None
                    if calibration is None or threshold is None
                    else calibration.score(threshold),
                    "interval": interval_json(interval),
                    "bound": bound_json(interval),
                }
            )
    return points

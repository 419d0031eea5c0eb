"""The error rates of a matcher, and the report of a run as one JSON document.

Text, tables and page are made of that document.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.gallery.batch.score import calibration_of
from fpmatch.lab.evaluation.rates.bootstrap import (
    BOOTSTRAP,
    BOOTSTRAPPED,
    CONFIDENCE,
    DEFAULT_BOOTSTRAP,
    bootstrap_rates,
    rate_interval,
)
from fpmatch.lab.evaluation.rates.error_rates import (
    FMR_LIMITS,
    POOLED,
    Rates,
    error_rates,
    fnmr_at_fmr,
    mean_rates,
    threshold_at_fmr,
)
from fpmatch.lab.evaluation.rates.run_comparison import common_pairs, compare_runs
from fpmatch.lab.evaluation.rates.scores import choose_matcher, split
from fpmatch.lab.evaluation.report.text import rates_table
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import DatasetSource
    from fpmatch.lab.evaluation.rates.scores import ScoresSet, Trials


@dataclass(frozen=True, slots=True, eq=False)
class SetRates:
    """The error rates of one database.

    `scores`: its comparisons. `rates`: error rates as fractions. `failures`: prints that have no
    template (failures to extract) and why; they score lowest in all pairs. `about` is what is known
    of the prints: failures, notes, identical ones; `source` has the prints. Of scores from a file
    they are empty.
    """

    scores: ScoresSet = field(repr=False)
    rates: Rates
    failures: tuple[tuple[str, str], ...]
    about: Mapping[str, Any] = field(default_factory=dict, repr=False)
    source: DatasetSource | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls,
        scores: ScoresSet,
        about: Mapping[str, Any] = MappingProxyType({}),
        source: DatasetSource | None = None,
    ) -> SetRates:
        """Return the rates of scores; prints that are never compared are failures to extract."""
        reasons = about.get("failures", {})
        named = {**dict.fromkeys(scores.never_compared, "no score"), **reasons}
        return cls(
            scores, error_rates(*split([scores.trials])), tuple(named.items()), about, source
        )

    @property
    def name(self) -> str:
        """Name of the database."""
        return self.scores.name


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class RatesReport:
    """The error rates of one matcher on some databases.

    `matcher`, `protocol`: names of the matcher and the protocol; of scores from a file, the latter
    is "". `sets`: a row a database. `mean`: the mean over the databases of each rate; None where a
    database lacks it. `pooled`: the rates of all databases' scores together, one threshold for all.
    """

    matcher: str
    protocol: str
    sets: tuple[SetRates, ...]
    mean: Rates
    pooled: Rates

    @classmethod
    def of(cls, sets: Sequence[SetRates], protocol: str = "") -> RatesReport:
        """Return the report on databases that one matcher has compared."""
        pooled = error_rates(*split([row.scores.trials for row in sets]))
        mean = mean_rates(row.rates for row in sets)
        return cls(sets[0].scores.matcher, protocol, tuple(sets), mean, pooled)

    def __repr__(self) -> str:
        pairs = f"{self.genuine} genuine and {self.impostor} impostor pairs"
        counts = f"{count(len(self.sets), 'database')}, {pairs}, {len(self.failures)} failed"
        eer = "no EER" if self.pooled.eer is None else f"EER {self.pooled.eer:.4f}"
        return f"{type(self).__name__}({self.matcher}, {counts}, {eer})"

    def _repr_html_(self) -> str:
        """Return the table that `fpmatch evaluate` prints, for notebooks."""
        from html import escape  # noqa: PLC0415  (for notebooks only)

        return f"<pre>{escape(self.as_text())}</pre>"

    @property
    def genuine(self) -> int:
        """Number of genuine pairs in all databases."""
        return sum(int(one.genuine.sum()) for one in self.trials)

    @property
    def impostor(self) -> int:
        """Number of impostor pairs in all databases."""
        return sum(one.genuine.size for one in self.trials) - self.genuine

    @property
    def failures(self) -> tuple[tuple[str, str], ...]:
        """Prints of all databases that have no template, and why."""
        return tuple(failure for row in self.sets for failure in row.failures)

    @property
    def scores(self) -> list[ScoresSet]:
        """The comparisons of each database."""
        return [replace(row.scores, matcher=self.matcher) for row in self.sets]

    @property
    def trials(self) -> list[Trials]:
        """The similarities and fingers of each database's comparisons."""
        return [row.scores.trials for row in self.sets]

    @property
    def impostors(self) -> list[Trials]:
        """The impostor comparisons of each database, none of a print without template."""
        return [row.scores.impostors for row in self.sets]

    def as_text(self) -> str:
        """Return the table that `fpmatch evaluate` prints."""
        return rates_table(self.as_json())

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values: rates as fractions, null where undefined."""
        sets = []
        for row in self.sets:
            figures = {"name": row.name, **_figures([row], row.rates)}
            figures["failure_rate"] = figures["failures"] / max(1, figures["prints"])
            if "identical" in row.about:
                figures["identical"] = row.about["identical"]
            sets.append(figures)
        pooled = _figures(self.sets, self.pooled)
        return {"sets": sets, "mean": asdict(self.mean), "pooled": pooled}


def _figures(sets: Sequence[SetRates], rates: Rates) -> dict[str, Any]:
    """Return what is reported of a database, or of the scores of several together, as JSON."""
    genuine, impostor = split([row.scores.trials for row in sets])
    return {
        "genuine": genuine.size,
        "impostor": impostor.size,
        **asdict(rates),
        "prints": sum(len(row.scores.prints) for row in sets),
        "failures": sum(len(row.failures) for row in sets),
    }


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
    how = {"bootstrap": bootstrap, "seed": seed}
    each = []
    for report in results:
        document = {"matcher": report.matcher, **report.as_json()}
        draws = None
        if bootstrap:
            asked = (*FMR_LIMITS.values(), *fmrs)
            draws = bootstrap_rates(report.trials, bootstrap, seed, asked)
            document["intervals"] = _intervals(report, document, draws, **how)
        if baseline is not None:
            earlier = _baseline_of(report, baseline, baseline_name)
            compared = compare_runs(earlier, report.scores, **how)
            document["baseline"] = {"name": baseline_name, **compared}
        if fmrs:
            document["fnmr_at_fmr"] = _operating_points(report, fmrs, draws)
        each.append(document)
    if len(each) == 1:
        return each[0]
    first, *others = (one.scores for one in results)
    against = [compare_runs(first, one, **how) for one in others if common_pairs(first, one)]
    return {"matchers": each, "against_first": against}


def _baseline_of(
    report: RatesReport, baseline: Sequence[ScoresSet], name: str
) -> Sequence[ScoresSet]:
    """Return the comparisons of a baseline by the report's matcher, or by its only one."""
    if len({one.matcher for one in baseline}) > 1:
        baseline = choose_matcher(baseline, report.matcher, name)
    if len(baseline) == len(report.sets) == 1 and baseline[0].name == Path(name).stem:
        return [replace(baseline[0], name=report.sets[0].name)]  # that of its file only
    return baseline


def _intervals(
    report: RatesReport, document: dict[str, Any], draws: tuple[Any, Any], bootstrap: int, seed: int
) -> dict[str, Any]:
    """Return the intervals of each database, of the mean, and of all scores pooled."""
    trials = report.trials
    return {
        "confidence": CONFIDENCE,
        "method": BOOTSTRAP,
        "bootstrap": bootstrap,
        "seed": seed,
        "sets": [_limits(row, draws[0][k], [trials[k]]) for k, row in enumerate(document["sets"])],
        "mean": _limits(document["mean"], draws[0].mean(axis=0), trials, mean=True),
        "pooled": _limits(document["pooled"], draws[1], trials),
    }


def _limits(
    rates: dict[str, Any],
    draws: NDArray[np.float64],
    trials: Sequence[Trials],
    *,
    mean: bool = False,
) -> dict[str, Any]:
    """Return the intervals of the rates of some comparisons; `draws` end with asked FMRs."""
    found = {
        name: rate_interval(name, rates[name], column, trials, mean=mean)
        for name, column in zip(BOOTSTRAPPED, draws.T, strict=False)
    }
    intervals = {name: interval for name, (interval, _) in found.items()}
    return {**intervals, "bounds": {name: bound for name, (_, bound) in found.items() if bound}}


def _operating_points(
    report: RatesReport, fmrs: Sequence[float], draws: tuple[Any, Any] | None
) -> list[dict[str, Any]]:
    """Return the FNMR at the lowest threshold with at most each FMR, of each database and of all.

    The `threshold` is the least score that matches, of distances the greatest; None where no pair
    matches. The last columns of `draws` are of these FMRs.
    """
    trials = report.trials
    parts: list[tuple[str, Sequence[Trials], Any]] = [
        (row.name, [trials[k]], draws and draws[0][k]) for k, row in enumerate(report.sets)
    ]
    if len(parts) > 1:
        parts.append((POOLED, trials, draws and draws[1]))
    calibration = calibration_of(report.matcher)
    sign = -1 if report.sets[0].scores.distances else 1
    points = []
    for name, of_part, drawn in parts:
        genuine, impostor = split(of_part)
        both = np.concatenate([genuine, impostor])
        for column, fmr in enumerate(fmrs, start=-len(fmrs)):
            fnmr, highest = fnmr_at_fmr(genuine, impostor, fmr), threshold_at_fmr(impostor, fmr)
            interval = bound = threshold = score = None
            if fnmr is not None and highest is not None and (above := both[both > highest]).size:
                threshold = sign * float(above.min())
                score = calibration.score(threshold) if calibration is not None else None
            if drawn is not None:
                interval, bound = rate_interval("fnmr", fnmr, drawn[:, column], of_part)
            point = {"name": name, "fmr": fmr, "fnmr": fnmr, "threshold": threshold}
            points.append({**point, "score": score, "interval": interval, "bound": bound})
    return points

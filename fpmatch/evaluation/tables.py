"""The results of an evaluation as tables of text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.decision import calibration_of
from fpmatch.evaluation.error_vs_discard import SHARES
from fpmatch.evaluation.rate_text import RATE_TITLES, defined_rates, percent, rate_cells
from fpmatch.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from fpmatch.evaluation.analysis import Analysis
    from fpmatch.evaluation.intervals import ExactBound, Interval, ReportIntervals
    from fpmatch.evaluation.quality_analysis import QualityAnalysis
    from fpmatch.evaluation.report import RatesReport
    from fpmatch.evaluation.run_comparison import (
        ChangedPair,
        DecisionChange,
        RateDifference,
        RunComparison,
    )

INTERVAL_TITLES: Final = {
    **{name: RATE_TITLES[name] for name in ("eer", "fmr100", "fmr1000", "fmr10000")},
    "rank_one": "rank-1",
}
_UNITS: Final = {
    "finger": "fingers",
    "subject": "subjects",
    "pair of fingers": "for the EER disjoint pairs of fingers",
    "comparison": "comparisons as if independent",
}
_PAIRS_NAMED: Final = 5
_LEAST_P: Final = 0.0001


def limits(interval: Interval | None, bound: ExactBound | None = None) -> str:
    """Write an interval in percent, "-" where there is none, and of a bound its trials.

    Examples
    --------
    >>> from fpmatch.evaluation.intervals import ExactBound, Interval
    >>> limits(Interval(0.01, 0.025)), limits(Interval(0.0, 0.2589), ExactBound("finger", 10))
    ('1.00 - 2.50 %', 'at most 25.89 % (0 of 10)')
    """
    if interval is None:
        return "-"
    if bound is None:
        return f"{100 * interval.low:.2f} - {100 * interval.high:.2f} %"
    if interval.low > 0:
        return f"at least {100 * interval.low:.2f} % ({bound.units} of {bound.units})"
    return f"at most {100 * interval.high:.2f} % (0 of {bound.units})"


def bounds_note(bounds: Iterable[ExactBound | None]) -> str:
    """Return the method of bounds and what they count, "" where there are no bounds."""
    found = {unit for one in bounds if one for unit in one.unit.split(" or ")}
    if not found:
        return ""
    counted = ", ".join(text for unit, text in _UNITS.items() if unit in found)
    return f"0 of n, n of n: 95 % bound by Clopper-Pearson, one-sided; n counts {counted}"


def points(difference: float) -> str:
    """Write a difference of rates in percentage points."""
    return f"{100 * difference:+.2f}"


def change_limits(difference: RateDifference) -> str:
    """Write the interval of a difference in percentage points, "-" where there is none."""
    interval, bound = difference.interval, difference.bound
    if interval is None:
        return "-"
    of = f" (0 of {bound.units})" if bound else ""
    return f"{points(interval.low)} to {points(interval.high)}{of}"


def format_matchers(reports: Sequence[RatesReport]) -> str:
    """Return a line a matcher: of several databases the mean EER, and the rates of all scores."""
    names = defined_rates(report.pooled for report in reports)
    several = len(reports[0].sets) > 1
    mean, pooled = (["mean EER"], "pooled ") if several else ([], "")
    head = ("side by side", *mean, *(pooled + RATE_TITLES[n] for n in names), "rank-1")
    rows = (
        (
            *(r.matcher, *[percent(r.mean.eer)] * several),
            *(*rate_cells(r.pooled, names), percent(r.rank_one)),
        )
        for r in reports
    )
    return text_table([head, *rows])


def format_intervals(report: RatesReport, intervals: ReportIntervals) -> str:
    """Return the lines of `RatesReport.as_text` with the intervals of the rates that have one."""
    rows = [(row.name, one) for row, one in zip(report.sets, intervals.sets, strict=True)]
    if len(rows) > 1:
        rows += [("mean", intervals.mean), ("pooled", intervals.pooled)]
    names = [n for n in INTERVAL_TITLES if any(getattr(one, n) is not None for _, one in rows)]
    if not names:
        known = all(row.scores.trials.fingers for row in report.sets)
        return f"95 % intervals: none, there are too few {'fingers' if known else 'comparisons'}"
    head = ("95 % intervals", *(INTERVAL_TITLES[name] for name in names))
    cells = [
        (title, *(limits(getattr(one, name), one.bounds.get(name)) for name in names))
        for title, one in rows
    ]
    return text_table([head, *cells])


def format_points(analysis: Analysis) -> str:
    """Return a line a database and FMR: the FNMR, its interval, and the threshold."""
    calibration, points = calibration_of(analysis.report.matcher), analysis.distinct_points
    rows = [("FNMR at FMR", "", "FNMR", "95 % interval", "threshold", "score")]
    for p in points:
        threshold, score = "-", "-"
        if p.threshold is not None:
            threshold = f"{p.threshold:.6g}"
            score = f"{calibration.score(p.threshold):.1f}" if calibration else ""
        at = f"{100 * p.fmr:.6g} %", percent(p.fnmr), limits(p.interval, p.bound)
        rows.append((p.name, *at, threshold, score))
    return text_table(rows if calibration else [row[:-1] for row in rows])


def format_discard(quality: QualityAnalysis) -> str:
    """Return the FNMR of each database where the prints of lowest quality are discarded."""
    head = (
        f"FNMR at FMR {100 * quality.fmr:.6g} %, of the worst prints discarded",
        *(f"{100 * share:.0f} %" for share in SHARES),
    )
    return text_table([head, *((c.name, *map(percent, c.fnmr)) for c in quality.curves)])


def format_comparison(comparison: RunComparison, name: str) -> str:
    """Return the rates before, in the run `name`, and now, and the decisions that changed.

    The table has the EER of each database, then all rates of mean and pooled scores; of one
    database all its rates.
    """
    c = comparison
    by = f", by matcher {c.before}" if c.before not in {"", c.now, name} else ""
    lines = [
        f"{c.now} compared with {name}{by}: {c.pooled.pairs:,} pairs in both, "
        f"{c.identical:,} with the same similarity"
    ]
    cells = [
        (
            *(f"{one.name} {RATE_TITLES[d.rate]}", f"{one.pairs:,}"),
            *(percent(d.before), percent(d.now), points(d.now - d.before)),
            *(change_limits(d), d.verdict),
        )
        for one, differences in c.shown()
        for d in differences
    ]
    lines.append(text_table([(" ", "pairs", *c.titles(), "points", "95 % interval", ""), *cells]))
    if c.only_before or c.only_now:
        lines.append(
            f"left out: {c.only_before:,} pairs that only the earlier run compared, "
            f"{c.only_now:,} that only this one did"
        )
    if c.decisions is not None:
        lines.append(decisions_sentence(c.decisions))
        lines += _named("now matching", c.decisions.gained)
        lines += _named("no longer", c.decisions.lost)
    return "\n".join(lines)


def decisions_sentence(decisions: DecisionChange) -> str:
    """Return how many decisions changed, and the p-value of the change."""
    d = decisions
    counts = (
        f"at a false match rate of {100 * d.fmr:g} %, of {d.genuine:,} genuine pairs "
        f"{len(d.gained):,} match now and did not, {len(d.lost):,} did and do not"
    )
    if not d.gained and not d.lost:
        return counts
    p = f"= {d.mcnemar_p:.2g}" if d.mcnemar_p >= _LEAST_P else f"< {_LEAST_P:g}"
    return f"{counts} (McNemar's exact test: p {p})"


def _named(label: str, pairs: Sequence[ChangedPair]) -> list[str]:
    lines = [f"  {label}: {p.set} {p.probe} {p.reference}" for p in pairs[:_PAIRS_NAMED]]
    rest = len(pairs) - _PAIRS_NAMED
    return [*lines, f"  {label}: {rest} more"] if rest > 0 else lines

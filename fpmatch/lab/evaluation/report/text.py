"""The report as tables of text, and intervals and differences in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.gallery.batch.decision import calibration_of
from fpmatch.lab.evaluation.rates.intervals import BOOTSTRAP
from fpmatch.lab.evaluation.report.analysis import WITH_INTERVALS
from fpmatch.lab.evaluation.report.results import (
    RATE_TITLES,
    defined_rates,
    percent,
    rate_cells,
)
from fpmatch.printable import text_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.rates.intervals import Interval
    from fpmatch.lab.evaluation.rates.run_comparison import DecisionChange, RunComparison
    from fpmatch.lab.evaluation.report.analysis import Analysis, Report
    from fpmatch.lab.evaluation.report.results import RatesReport

TITLES: Final = {**RATE_TITLES, "rank_one": "rank-1"}
TOO_FEW: Final = "too few fingers"
_UNITS: Final = {
    "finger": "fingers",
    "subject": "subjects",
    "pair of fingers": "for the EER disjoint pairs of fingers",
    "comparison": "comparisons as if independent",
}
_LEAST_P: Final = 0.0001


def as_text(report: Report) -> str:
    """Return the report as tables; several matchers are side by side at the end."""
    first = report.analyses[0].report.matcher
    parts = [_tables(one) for one in report.analyses]
    if len(parts) > 1 or ":" in first:  # which states parameters
        parts = [
            f"matcher {one.report.matcher}\n{part}"
            for one, part in zip(report.analyses, parts, strict=True)
        ]
    if len(parts) > 1:
        parts.append(_side_by_side([one.report for one in report.analyses]))
        parts += [comparison_text(one, first) for one in report.comparisons]
    return "\n\n".join(filter(None, [*parts, bounds_note(_intervals(report))]))


def limits(interval: Interval | None) -> str:
    """Write an interval in percent, and of a limit by Clopper and Pearson its trials.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.intervals import Interval, exact_interval
    >>> limits(Interval(0.01, 0.025)), limits(exact_interval(0.0, 10, "finger")), limits(None)
    ('1.00 - 2.50 %', 'at most 25.89 % (0 of 10)', 'too few fingers')
    """
    if interval is None:
        return TOO_FEW
    if interval.method == BOOTSTRAP:
        return f"{100 * interval.low:.2f} - {100 * interval.high:.2f} %"
    if interval.low > 0:
        return f"at least {100 * interval.low:.2f} % ({interval.trials} of {interval.trials})"
    return f"at most {100 * interval.high:.2f} % (0 of {interval.trials})"


def bounds_note(intervals: Iterator[Interval | None]) -> str:
    """Return the method of limits and what they count, "" where all are of the bootstrap."""
    units = {one.unit for one in intervals if one is not None and one.method != BOOTSTRAP}
    if not units:
        return ""
    counted = ", ".join(text for unit, text in _UNITS.items() if unit in units)
    return f"0 of n, n of n: 95 % bound by Clopper-Pearson, one-sided; n counts {counted}"


def points(difference: float) -> str:
    """Write a difference of rates in percentage points, without a minus before zero.

    Examples
    --------
    >>> points(-0.00001), points(0.0123)
    ('+0.00', '+1.23')
    """
    return f"{round(100 * difference, 2) + 0.0:+.2f}"


def change_limits(interval: Interval | None) -> str:
    """Write the interval of a difference in percentage points, "-" where there is none."""
    return "-" if interval is None else f"{points(interval.low)} to {points(interval.high)}"


def decisions_sentence(decisions: DecisionChange) -> str:
    """Return the p-value of the change of decisions, and how many changed."""
    d = decisions
    p = f"= {d.mcnemar_p:.2g}" if d.mcnemar_p >= _LEAST_P else f"< {_LEAST_P:g}"
    return (
        f"McNemar's exact test: p {p}; at a false match rate of {100 * d.fmr:g} %, of "
        f"{d.genuine:,} genuine pairs {len(d.gained):,} match now and did not, "
        f"{len(d.lost):,} did and do not"
    )


def column_titles(comparison: RunComparison) -> tuple[str, str]:
    """Return the column titles of the two runs: their matchers, where these differ."""
    before, now = comparison.before, comparison.now
    return ("before", "now") if before in {"", now} else (before, now)


def comparison_text(c: RunComparison, name: str) -> str:
    """Return the comparison with the run `name`: p-value, and the rates before and now.

    The table has the EER of each database, then all rates of mean and pooled scores; of one
    database all its rates.
    """
    by = f", by matcher {c.before}" if c.before not in {"", c.now, name} else ""
    lines = [
        f"{c.now} compared with {name}{by}: {c.pooled.pairs:,} pairs in both, "
        f"{c.identical:,} with the same similarity"
    ]
    if c.decisions is not None:
        lines.append(decisions_sentence(c.decisions))
    rows = [(" ", "pairs", *column_titles(c), "points", "95 % interval", "")]
    rows += [
        (
            *(f"{one.name} {RATE_TITLES[d.rate]}", f"{one.pairs:,}"),
            *(percent(d.before), percent(d.now), points(d.now - d.before)),
            *(change_limits(d.interval), d.verdict),
        )
        for one, differences in c.shown()
        for d in differences
    ]
    lines.append(text_table(rows))
    if c.only_before or c.only_now:
        lines.append(
            f"left out: {c.only_before:,} pairs that only the earlier run compared, "
            f"{c.only_now:,} that only this one did"
        )
    return "\n".join(lines)


def _intervals(report: Report) -> Iterator[Interval | None]:
    for one in report.analyses:
        yield from (interval for part in one.intervals for interval in part.values())
        yield from (point.interval for point in one.points)


def _tables(analysis: Analysis) -> str:
    parts = [analysis.report.as_text()]
    if analysis.intervals:
        parts.append(_interval_table(analysis))
    if analysis.points:
        parts.append(_points_table(analysis))
    if analysis.baseline is not None:
        parts.append(comparison_text(analysis.baseline, analysis.baseline_name))
    return "\n\n".join(parts)


def _side_by_side(reports: Sequence[RatesReport]) -> str:
    """Return a line a matcher: of several databases the mean EER, and the rates of all scores."""
    names = defined_rates(report.pooled for report in reports)
    several = len(reports[0].sets) > 1
    mean, pooled = (["mean EER"], "pooled ") if several else ([], "")
    head = ("side by side", *mean, *(pooled + RATE_TITLES[n] for n in names), "rank-1")
    rows = [
        (
            *(r.matcher, *[percent(r.mean.eer)] * several),
            *(*rate_cells(r.pooled, names), percent(r.rank_one)),
        )
        for r in reports
    ]
    return text_table([head, *rows])


def _interval_table(analysis: Analysis) -> str:
    """Return the lines of the rates with the intervals of those that have one."""
    report = analysis.report
    rows = [
        (row.name, row.rates, row.rank_one, of_row)
        for row, of_row in zip(report.sets, analysis.intervals, strict=False)
    ]
    if len(report.sets) > 1:
        rows.append(("mean", report.mean, None, analysis.intervals[-2]))
        rows.append(("pooled", report.pooled, report.rank_one, analysis.intervals[-1]))
    if not any(one for *_, of_row in rows for one in of_row.values()):
        return "95 % intervals: none, there are too few fingers"
    table = []
    for name, rates, rank_one, of_row in rows:
        values = [*(getattr(rates, rate) for rate in WITH_INTERVALS[:-1]), rank_one]
        cells = zip(values, of_row.values(), strict=True)
        table.append((name, *("-" if rate is None else limits(one) for rate, one in cells)))
    used = [k for k in range(len(WITH_INTERVALS) + 1) if any(row[k] != "-" for row in table)]
    head = ("95 % intervals", *(TITLES[name] for name in WITH_INTERVALS))
    return text_table([[row[k] for k in used] for row in [head, *table]])


def _points_table(analysis: Analysis) -> str:
    """Return a line a database and FMR: the FNMR, its interval, and the threshold."""
    calibration = calibration_of(analysis.report.matcher)
    rows = [("FNMR at FMR", "", "FNMR", "95 % interval", "threshold", "score")]
    for p in analysis.points:
        threshold, score = "-", "-"
        if p.threshold is not None:
            threshold = f"{p.threshold:.6g}"
            score = f"{calibration.score(p.threshold):.1f}" if calibration else ""
        interval = limits(p.interval) if analysis.bootstrap and p.fnmr is not None else "-"
        at = f"{100 * p.fmr:.6g} %", percent(p.fnmr), interval
        rows.append((p.name, *at, threshold, score))
    return text_table(rows if calibration else [row[:-1] for row in rows])

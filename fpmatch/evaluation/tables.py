"""The results of an evaluation as tables of text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.decision import calibration_of
from fpmatch.evaluation.error_vs_discard import SHARES
from fpmatch.evaluation.rate_text import RATE_TITLES, defined_rates, percent, rate_cells
from fpmatch.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.intervals import Interval, ReportIntervals
    from fpmatch.evaluation.operating_points import OperatingPoint
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
_PAIRS_NAMED: Final = 5
_LEAST_P: Final = 0.0001


def limits(interval: Interval | None) -> str:
    """Write an interval in percent, "-" where there is none."""
    return f"{100 * interval.low:.2f} - {100 * interval.high:.2f} %" if interval else "-"


def points(difference: float) -> str:
    """Write a difference of rates in percentage points."""
    return f"{100 * difference:+.2f}"


def change_limits(difference: RateDifference) -> str:
    """Write the interval of a difference in percentage points, "-" where there is none."""
    interval = difference.interval
    return f"{points(interval.low)} to {points(interval.high)}" if interval else "-"


def format_matchers(reports: Sequence[RatesReport]) -> str:
    """Return a line a matcher: mean EER, and the rates of all scores pooled."""
    names = defined_rates(report.pooled for report in reports)
    head = ("side by side", "mean EER", *(f"pooled {RATE_TITLES[n]}" for n in names), "rank-1")
    rows = (
        (r.matcher, percent(r.mean.eer), *rate_cells(r.pooled, names), percent(r.rank_one))
        for r in reports
    )
    return text_table([head, *rows])


def format_intervals(report: RatesReport, intervals: ReportIntervals) -> str:
    """Return the lines of `RatesReport.as_text` with the intervals of the rates that have one."""
    rows = [
        *((row.name, one) for row, one in zip(report.sets, intervals.sets, strict=True)),
        ("mean", intervals.mean),
        ("pooled", intervals.pooled),
    ]
    names = [n for n in INTERVAL_TITLES if any(getattr(one, n) is not None for _, one in rows)]
    if not names:
        known = all(row.scores.trials.fingers for row in report.sets)
        return f"95 % intervals: none, there are too few {'fingers' if known else 'comparisons'}"
    head = ("95 % intervals", *(INTERVAL_TITLES[name] for name in names))
    cells = [(title, *(limits(getattr(one, name)) for name in names)) for title, one in rows]
    return text_table([head, *cells])


def format_points(points: Sequence[OperatingPoint], matcher: str) -> str:
    """Return a line a database and FMR: the FNMR, its interval, and the threshold."""
    calibration = calibration_of(matcher)
    rows = [("FNMR at FMR", "", "FNMR", "95 % interval", "threshold", "score")]
    for p in points:
        threshold, score = "-", "-"
        if p.threshold is not None:
            threshold = f"{p.threshold:.6g}"
            score = f"{calibration.score(p.threshold):.1f}" if calibration else ""
        at = f"{100 * p.fmr:.6g} %", percent(p.fnmr), limits(p.interval)
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

    The table has the EER of each database, then all rates of mean and pooled scores.
    """
    c = comparison
    by = f", by matcher {c.before}" if c.before not in {"", c.now, name} else ""
    lines = [
        f"{c.now} compared with {name}{by}: {c.pooled.pairs:,} pairs in both, "
        f"{c.identical:,} with the same similarity"
    ]
    parts = [(one, one.differences[:1]) for one in c.sets]
    parts += [(one, one.differences) for one in (c.mean, c.pooled)]
    cells = [
        (
            *(f"{one.name} {RATE_TITLES[d.rate]}", f"{one.pairs:,}"),
            *(percent(d.before), percent(d.now), points(d.now - d.before)),
            *(change_limits(d), d.verdict),
        )
        for one, differences in parts
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

"""The tables of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.evaluation.html.markup import Html, element, joined, table, text
from fpmatch.evaluation.interval_table import INTERVAL_TITLES, limits
from fpmatch.evaluation.run_comparison_table import points
from fpmatch.evaluation.table import RATE_TITLES, percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.analysis import Analysis
    from fpmatch.evaluation.intervals import RateIntervals
    from fpmatch.evaluation.rates import Rates
    from fpmatch.evaluation.run_comparison_result import PairedComparison, PairedSet, RateDifference


def rate_table(analysis: Analysis) -> Html:
    """Return a row a database, their mean, and all scores pooled, each rate with its interval."""
    report, intervals = analysis.report, analysis.intervals
    names = [n for n in RATE_TITLES if any(getattr(r, n) is not None for r in _all_rates(analysis))]
    head = [
        *("database", "prints", "failed", "genuine", "impostor"),
        *(RATE_TITLES[name] for name in names),
        *("rank-1", "extract", "match"),
    ]
    rows = []
    for k, row in enumerate(report.sets):
        own = None if intervals is None else intervals.sets[k]
        found = None if row.identification is None else row.identification.rank_one
        rows.append(
            [
                *_plain(row.name, row.prints, len(row.failures), row.genuine, row.impostor),
                *_rates(row.rates, names, own),
                _rate(found, own, "rank_one"),
                text(f"{row.extract_ms:.0f} ms"),
                text(f"{row.match_us:.0f} µs"),
            ]
        )
    sums = [
        sum(values)
        for values in zip(
            *((r.prints, len(r.failures), r.genuine, r.impostor) for r in report.sets), strict=True
        )
    ]
    mean, pooled = (intervals.mean, intervals.pooled) if intervals else (None, None)
    blank = text("")
    rows.append(
        [text("mean"), *[blank] * 4, *_rates(report.mean, names, mean), blank, blank, blank]
    )
    rows.append(
        [
            *_plain("pooled", *sums),
            *_rates(report.pooled, names, pooled),
            *(_rate(report.rank_one, pooled, "rank_one"), blank, blank),
        ]
    )
    return table(head, rows, strong=2)


def matchers_table(analyses: Sequence[Analysis]) -> Html:
    """Return a row a matcher: mean and pooled rates."""
    names = [
        n for n in RATE_TITLES if any(getattr(a.report.pooled, n) is not None for a in analyses)
    ]
    head = ["matcher", "mean EER", *(f"pooled {RATE_TITLES[name]}" for name in names), "rank-1"]
    rows = []
    for one in analyses:
        mean, pooled = (one.intervals.mean, one.intervals.pooled) if one.intervals else (None, None)
        rows.append(
            [
                text(one.report.matcher),
                _rate(one.report.mean.eer, mean, "eer"),
                *_rates(one.report.pooled, names, pooled),
                _rate(one.report.rank_one, pooled, "rank_one"),
            ]
        )
    return table(head, rows)


def paired_table(comparison: PairedComparison) -> Html:
    """Return the rates before and now, a row a rate."""
    rows = [
        *(row for one in comparison.sets for row in _paired_rows(one, one.changes[:1])),
        *_paired_rows(comparison.mean, comparison.mean.changes),
        *_paired_rows(comparison.pooled, comparison.pooled.changes),
    ]
    strong = len(comparison.mean.changes) + len(comparison.pooled.changes)
    head = ["rate", "pairs", *comparison.titles(), "change in points", "95 % interval", "verdict"]
    return table(head, rows, strong=strong)


def _all_rates(analysis: Analysis) -> list[Rates]:
    return [*(row.rates for row in analysis.report.sets), analysis.report.pooled]


def _plain(*values: object) -> list[Html]:
    return [text(f"{v:,}" if isinstance(v, int) else str(v)) for v in values]


def _rates(rates: Rates, names: list[str], intervals: RateIntervals | None) -> list[Html]:
    return [_rate(getattr(rates, name), intervals, name) for name in names]


def _rate(rate: float | None, intervals: RateIntervals | None, name: str) -> Html:
    known = intervals is not None and name in INTERVAL_TITLES
    interval = getattr(intervals, name) if known else None
    if interval is None:
        return text(percent(rate))
    between = limits(interval).removesuffix(" %").replace(" - ", "–")
    return joined([text(percent(rate)), element("small", text(between))])


def _paired_rows(one: PairedSet, changes: Sequence[RateDifference]) -> list[list[Html]]:
    return [
        [
            text(f"{one.name} {RATE_TITLES[change.rate]}"),
            text(f"{one.pairs:,}"),
            text(percent(change.before)),
            text(percent(change.now)),
            text(points(change.now - change.before)),
            text(
                f"{points(change.interval.low)} to {points(change.interval.high)}"
                if change.interval
                else "-"
            ),
            element("span", text(change.verdict), **_tone(change.verdict)),
        ]
        for change in changes
    ]


def _tone(verdict: str) -> dict[str, str]:
    tone = {"better": "good", "worse": "bad"}.get(verdict)
    return {"class_": tone} if tone else {}

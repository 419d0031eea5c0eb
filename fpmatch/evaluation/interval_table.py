"""The intervals of an evaluation's rates as a table of text, for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.table import RATE_TITLES
from fpmatch.text_table import text_table

if TYPE_CHECKING:
    from fpmatch.evaluation.intervals import Interval, RateIntervals, ReportIntervals
    from fpmatch.evaluation.report import EvaluationReport

INTERVAL_TITLES: Final = {
    **{name: RATE_TITLES[name] for name in ("eer", "fmr100", "fmr1000", "fmr10000")},
    "rank_one": "rank-1",
}


def format_intervals(report: EvaluationReport, intervals: ReportIntervals) -> str:
    """Return a line a database, their mean, and all scores pooled; limits in percent.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.
    intervals : ReportIntervals
        Its intervals.

    Returns
    -------
    str
        Lines of equal columns, or one line where there are no intervals; rates that no database
        has an interval for are left out.
    """
    rows = [
        *((row.name, one) for row, one in zip(report.sets, intervals.sets, strict=True)),
        ("mean", intervals.mean),
        ("pooled", intervals.pooled),
    ]
    names = [n for n in INTERVAL_TITLES if any(getattr(one, n) is not None for _, one in rows)]
    if not names:
        return "95 % intervals: none, there are too few fingers"
    head = ("95 % intervals", *(INTERVAL_TITLES[name] for name in names))
    return text_table([head, *((title, *_cells(one, names)) for title, one in rows)])


def _cells(intervals: RateIntervals, names: list[str]) -> list[str]:
    return [limits(getattr(intervals, name)) for name in names]


def limits(interval: Interval | None) -> str:
    """Write an interval in percent, "-" where there is none.

    Examples
    --------
    >>> from fpmatch.evaluation.intervals import Interval
    >>> limits(Interval(0.012, 0.034)), limits(None)
    ('1.20 - 3.40 %', '-')
    """
    if interval is None:
        return "-"
    return f"{100 * interval.low:.2f} - {100 * interval.high:.2f} %"

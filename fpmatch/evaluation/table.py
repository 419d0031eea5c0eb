"""An evaluation's report as a table of text, for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.rates import Rates
    from fpmatch.evaluation.report import EvaluationReport, SetResult

_HEAD: Final = ("database", "genuine", "impostor")
RATE_TITLES: Final = {
    "eer": "EER",
    "fmr100": "FMR100",
    "fmr1000": "FMR1000",
    "fmr10000": "FMR10000",
    "zero_fmr": "ZeroFMR",
    "zero_fnmr": "ZeroFNMR",
}
_HEAD_OF_SETS: Final = ("rank-1", "failed", "extract", "match")
_UNDEFINED: Final = "-"


def format_table(report: EvaluationReport) -> str:
    """Return a line a database, their mean, and all scores pooled; rates in percent.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.

    Returns
    -------
    str
        Lines of equal columns; "-" where the pairs do not allow a rate. FMR10000 is left out where
        no database has pairs enough for it.
    """
    genuine = sum(row.genuine for row in report.sets)
    impostor = sum(row.impostor for row in report.sets)
    failed = sum(len(row.failures) for row in report.sets)
    rates = [*(row.rates for row in report.sets), report.pooled]
    names = [
        n for n in RATE_TITLES if n != "fmr10000" or any(r.fmr10000 is not None for r in rates)
    ]
    cells = [
        (*_HEAD, *(RATE_TITLES[name] for name in names), *_HEAD_OF_SETS),
        *(_set_cells(row, names) for row in report.sets),
        ("mean", "", "", *_rates_in_percent(report.mean, names), *("",) * len(_HEAD_OF_SETS)),
        (
            *("pooled", str(genuine), str(impostor), *_rates_in_percent(report.pooled, names)),
            *(percent(report.rank_one), str(failed), "", ""),
        ),
    ]
    return text_table(cells)


def format_matchers(reports: Sequence[EvaluationReport]) -> str:
    """Return a line a matcher: mean EER, and the rates of all scores pooled.

    Parameters
    ----------
    reports : sequence of EvaluationReport
        Evaluations of the same databases, one a matcher.

    Returns
    -------
    str
        Lines of equal columns.
    """
    names = [n for n in RATE_TITLES if any(getattr(r.pooled, n) is not None for r in reports)]
    cells = [
        ("side by side", "mean EER", *(f"pooled {RATE_TITLES[name]}" for name in names), "rank-1"),
        *(
            (
                *(report.matcher, percent(report.mean.eer)),
                *_rates_in_percent(report.pooled, names),
                percent(report.rank_one),
            )
            for report in reports
        ),
    ]
    return text_table(cells)


def _set_cells(row: SetResult, names: list[str]) -> tuple[str, ...]:
    counts = (str(row.genuine), str(row.impostor))
    found = percent(row.identification.rank_one if row.identification else None)
    times = (f"{row.extract_ms:.1f} ms", f"{row.match_us:.0f} µs")
    return (
        *(row.name, *counts, *_rates_in_percent(row.rates, names)),
        *(found, str(len(row.failures)), *times),
    )


def _rates_in_percent(rates: Rates, names: list[str]) -> list[str]:
    return [percent(getattr(rates, name)) for name in names]


def percent(rate: float | None) -> str:
    """Write a rate in percent, "-" where there is none.

    Examples
    --------
    >>> percent(0.0123), percent(None)
    ('1.23 %', '-')
    """
    return _UNDEFINED if rate is None else f"{100 * rate:.2f} %"

"""An evaluation's report as a table of text, for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from fpmatch.evaluation.rates import Rates
    from fpmatch.evaluation.report import EvaluationReport, SetResult

_HEAD: Final = ("database", "genuine", "impostor", "EER", "FMR100", "FMR1000", "ZeroFMR")
_HEAD_OF_SETS: Final = ("failed", "extract", "match")
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
        Lines of equal columns; "-" where the pairs do not allow a rate.
    """
    genuine = sum(row.genuine for row in report.sets)
    impostor = sum(row.impostor for row in report.sets)
    failed = sum(len(row.failures) for row in report.sets)
    cells = [
        (*_HEAD, *_HEAD_OF_SETS),
        *map(_set_cells, report.sets),
        ("mean", "", "", *_percent(report.mean), "", "", ""),
        ("pooled", str(genuine), str(impostor), *_percent(report.pooled), str(failed), "", ""),
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join(_line(row, widths) for row in cells)


def _set_cells(row: SetResult) -> tuple[str, ...]:
    counts = (str(row.genuine), str(row.impostor))
    times = (f"{row.extract_ms:.1f} ms", f"{row.match_us:.0f} µs")
    return (row.name, *counts, *_percent(row.rates), str(len(row.failures)), *times)


def _percent(rates: Rates) -> list[str]:
    values = (rates.eer, rates.fmr100, rates.fmr1000, rates.zero_fmr)
    return [_UNDEFINED if value is None else f"{100 * value:.2f} %" for value in values]


def _line(cells: tuple[str, ...], widths: list[int]) -> str:
    first, *others = (
        cell.rjust(width) if column else cell.ljust(width)
        for column, (cell, width) in enumerate(zip(cells, widths, strict=True))
    )
    return "  ".join([first, *others]).rstrip()

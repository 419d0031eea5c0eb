"""Rates as LaTeX or CSV, with the intervals of the text, and DET curves as CSV."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.folders import make_folder
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.errors import OutputError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.lab.evaluation.rates.error_rates import POOLED, error_curves
from fpmatch.lab.evaluation.report.analysis import WITH_INTERVALS
from fpmatch.lab.evaluation.report.figures import det_curves
from fpmatch.lab.evaluation.report.results import RATE_TITLES, defined_rates, percent
from fpmatch.lab.evaluation.report.text import limits

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.report.analysis import Analysis, Intervals
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

    Row = tuple[str, SetRates | RatesReport, Intervals]

TABLE_FORMATS: Final = (".tex", ".csv")
CURVES: Final = "det.csv"
_ESCAPED: Final = {**{c: f"\\{c}" for c in "&%$#_{}"}, "\\": "\\textbackslash{}"} | {
    "~": "\\textasciitilde{}",
    "^": "\\textasciicircum{}",
}


def check_table(path: Path) -> None:
    """Raise an OutputError if a table cannot be written to a file of this name."""
    if path.suffix.lower() not in TABLE_FORMATS:
        raise OutputError(f"{path}: a table's name ends with {', '.join(TABLE_FORMATS)}")
    check_writable(path)


def save_table(path: str | os.PathLike[str], analyses: Sequence[Analysis]) -> None:
    """Write the rates of each matcher and database, as LaTeX (.tex) or CSV, with their intervals.

    Of several databases, all scores pooled make one more row. Rates are fractions in CSV, percent
    in LaTeX. Raises an OutputError if the file cannot be written.
    """
    rows = [(one.report.matcher, *row) for one in analyses for row in _rows(one)]
    names = [*defined_rates(row.pooled for row in (one.report for one in analyses)), "rank_one"]
    if Path(path).suffix.lower() == ".csv":
        atomic_write_bytes(path, csv_lines(_csv(rows, names)))
        return
    titles = (RATE_TITLES.get(name, "rank-1") for name in names)
    head = ("matcher", "database", "genuine", "impostor", *titles)
    lines = [f"\\begin{{tabular}}{{ll{'r' * (len(head) - 2)}}}", "\\hline"]
    lines += [" & ".join(head) + " \\\\", "\\hline"]
    for matcher, name, row, intervals in rows:
        cells = [_escaped(matcher), _escaped(name), str(row.genuine), str(row.impostor)]
        for rate in names:
            value, shown = _rate(row, rate), ""
            if value is not None and rate in intervals:
                shown = f" [{limits(intervals[rate]).replace(' - ', '--')}]"
            cells.append(_escaped(percent(value).removesuffix(" %") + shown))
        lines.append(" & ".join(cells) + " \\\\")
    lines += ["\\hline", "\\multicolumn{2}{l}{Rates in \\%.} \\\\", "\\end{tabular}", ""]
    atomic_write_bytes(path, "\n".join(lines).encode())


def _rows(analysis: Analysis) -> Iterator[Row]:
    report = analysis.report
    known = analysis.intervals or ({},) * (len(report.sets) + 2)
    yield from ((row.name, row, of_row) for row, of_row in zip(report.sets, known, strict=False))
    if len(report.sets) > 1:
        yield POOLED, report, known[-1]


def _rate(row: SetRates | RatesReport, name: str) -> float | None:
    if name == "rank_one":
        return row.rank_one
    rate: float | None = getattr(getattr(row, "rates", None) or row.pooled, name)  # type: ignore[union-attr]
    return rate


def _csv(
    rows: Sequence[tuple[str, str, SetRates | RatesReport, Intervals]], names: Sequence[str]
) -> Iterator[Sequence[object]]:
    limited = {name: (f"{name}_low", f"{name}_high") for name in names if name in WITH_INTERVALS}
    head = [column for name in names for column in (name, *limited.get(name, ()))]
    yield ("matcher", "set", "genuine", "impostor", *head)
    for matcher, name, row, intervals in rows:
        cells: list[object] = []
        for rate in names:
            cells.append(_rate(row, rate))
            if rate in limited:
                one = intervals.get(rate)
                cells += [None, None] if one is None else [one.low, one.high]
        shown = ["" if cell is None else cell for cell in cells]
        yield (matcher, name, row.genuine, row.impostor, *shown)


def _escaped(text: str) -> str:
    return "".join(_ESCAPED.get(character, character) for character in text)


def prepare_curves(folder: str | os.PathLike[str]) -> Path:
    """Make a folder for the file of `write_curves`, and return that; errors as `make_folder`."""
    make_folder(folder)
    check_writable(file := Path(folder) / CURVES)
    return file


def write_curves(folder: str | os.PathLike[str], reports: Sequence[RatesReport]) -> Path:
    """Write FMR and FNMR at each threshold where one of them turns; return the file."""
    rows: list[Sequence[object]] = [("matcher", "set", "threshold", "fmr", "fnmr")]
    for report in reports:
        sign = -1 if report.sets[0].scores.distances else 1
        for curve in det_curves([report]):
            errors = error_curves(curve.genuine, curve.impostor)
            x, y = np.diff(errors.fmr) == 0, np.diff(errors.fnmr) == 0
            straight = np.r_[False, (x[1:] & x[:-1]) | (y[1:] & y[:-1]), False]
            kept = np.flatnonzero(~straight)
            points = (errors.threshold[kept] * sign, errors.fmr[kept], errors.fnmr[kept])
            for point in zip(*(column.tolist() for column in points), strict=True):
                rows.append((report.matcher, curve.label, *point))
    file = prepare_curves(folder)
    atomic_write_bytes(file, csv_lines(rows))
    return file

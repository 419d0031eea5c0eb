"""What a paper shows of an evaluation: DET curves as a file, and a table of rates for LaTeX or CSV.

`fpmatch.lab.evaluation.report.page` has the same for a page.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.errors import OutputError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.lab.evaluation.report.det import det_curves, draw_det
from fpmatch.lab.evaluation.report.figures import new_axes
from fpmatch.lab.evaluation.report.operating_points import RateIntervals
from fpmatch.lab.evaluation.report.rate_text import RATE_TITLES, defined_rates
from fpmatch.lab.plots.style import PLOT_DPI, check_plot, figure_bytes, plain_style

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.rates.error_rates import Rates
    from fpmatch.lab.evaluation.report.analysis import Analysis
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

    Row = tuple[str, str, SetRates | RatesReport, Rates, RateIntervals]

TABLE_FORMATS: Final = (".tex", ".csv")
_ESCAPED: Final = {**{c: f"\\{c}" for c in "&%$#_{}"}, "\\": "\\textbackslash{}"} | {
    "~": "\\textasciitilde{}",
    "^": "\\textasciicircum{}",
}


def prepare_files(det: Path | None, table: Path | None) -> None:
    """Raise an OutputError if the plot or the table cannot be written."""
    if det is not None:
        check_plot(det)
    if table is not None:
        if table.suffix.lower() not in TABLE_FORMATS:
            raise OutputError(f"{table}: a table's name ends with {', '.join(TABLE_FORMATS)}")
        check_writable(table)


def save_det(path: str | os.PathLike[str], reports: Sequence[RatesReport]) -> None:
    """Draw the DET curves of some matchers, all databases pooled; of one matcher, of each database.

    Raises an OutputError as `check_plot`, and where a kind of pair is missing.
    """
    check_plot(path)
    curves = det_curves(reports)
    if not curves:
        raise OutputError(f"{path}: a DET needs genuine and impostor pairs")
    with plain_style():
        figure, axes = new_axes()
        draw_det(axes, curves)
        axes.legend([curve.title for curve in curves], frameon=False)
        atomic_write_bytes(path, figure_bytes(figure, path, PLOT_DPI))


def save_table(path: str | os.PathLike[str], analyses: Sequence[Analysis]) -> None:
    """Write the rates of each matcher and database, as LaTeX (.tex) or CSV, with 95 % intervals.

    Of several databases, all scores pooled make one more row. Rates are fractions in CSV, percent
    in LaTeX. Raises an OutputError if the file cannot be written.
    """
    rows = [row for analysis in analyses for row in _rows(analysis)]
    names = defined_rates(rates for *_, rates, _ in rows)
    if Path(path).suffix.lower() == ".csv":
        content = csv_lines(_csv(rows, names))
    else:
        content = _latex(rows, names).encode()
    atomic_write_bytes(path, content)


def _rows(analysis: Analysis) -> Iterator[Row]:
    report, known = analysis.report, analysis.intervals
    for k, row in enumerate(report.sets):
        interval = RateIntervals() if known is None else known.sets[k]
        yield report.matcher, row.name, row, row.rates, interval
    if len(report.sets) > 1:
        interval = RateIntervals() if known is None else known.pooled
        yield report.matcher, "pooled", report, report.pooled, interval


def _csv(rows: Sequence[Row], names: Sequence[str]) -> Iterator[Sequence[object]]:
    limited = [name for name in names if hasattr(RateIntervals, name)]
    head = [column for name in names for column in _columns(name, limited)]
    yield ("matcher", "set", "genuine", "impostor", *head, "d_prime", "rank_one")
    for matcher, name, counts, rates, intervals in rows:
        cells: list[Any] = []
        for rate in names:
            cells.append(getattr(rates, rate))
            if rate in limited:
                cells += intervals.of(rate)[0] or ("", "")
        cells += (rates.d_prime, counts.rank_one)
        shown = ["" if cell is None else cell for cell in cells]
        yield (matcher, name, counts.genuine, counts.impostor, *shown)


def _columns(name: str, limited: Sequence[str]) -> list[str]:
    return [name, f"{name}_low", f"{name}_high"] if name in limited else [name]


def _latex(rows: Sequence[Row], names: Sequence[str]) -> str:
    """Return a tabular that needs no package; in percent, the EER with its interval."""
    head = ("matcher", "database", "genuine", "impostor", *(RATE_TITLES[name] for name in names))
    lines = [f"\\begin{{tabular}}{{ll{'r' * (len(head) - 2)}}}", "\\hline"]
    lines += [" & ".join(head) + " \\\\", "\\hline"]
    for matcher, name, counts, rates, intervals in rows:
        shown = [_in_percent(getattr(rates, rate)) for rate in names]
        if (limits := intervals.eer) is not None:
            shown[0] += f" [{_in_percent(limits.low)}, {_in_percent(limits.high)}]"
        cells = (_escaped(matcher), _escaped(name), str(counts.genuine), str(counts.impostor))
        lines.append(" & ".join((*cells, *shown)) + " \\\\")
    return "\n".join([*lines, "\\hline", "\\end{tabular}", ""])


def _in_percent(rate: float | None) -> str:
    return "--" if rate is None else f"{100 * rate:.2f}"


def _escaped(text: str) -> str:
    return "".join(_ESCAPED.get(character, character) for character in text)

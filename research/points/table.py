"""The results on random point sets as tables beside the paper's own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from research.markdown import markdown_table
from research.points.conditions import PAPER_ROWS, TARGET_FACTORS, Condition
from research.points.matchers import MATCHER_NAMES
from research.points.random_sets import POINT_MODELS
from research.points.summary import summarise

if TYPE_CHECKING:
    from collections.abc import Callable

    from research.points.conditions import PaperRow
    from research.points.random_sets import PointModel
    from research.points.results import BenchResults, PointCell

    Line = tuple[str, ...]

# By matcher: the paper's table beside which it stands, and the column of that table.
_PUBLISHED: Final = {
    "triangles": ("Table 2", "unit_circle_s"),
    "paper": ("Table 2", "unit_circle_s"),
    "van-wamelen": ("Table 1", "van_wamelen_s"),
}
_PARAMETERS: Final = ("m", "rho", "eta", "lambda")
_ABSENT: Final = "-"
_EDGES: Final = (100.0, 10.0, 0.1)  # milliseconds below which a time has one decimal more

LEGEND: Final = (
    "median, mean: time of a match of a genuine pair from the bare points, ms; paper: the mean "
    "time that the paper gives, ms; indep.: median time of a match of an independent pair, ms",
    "TP, true positives: genuine pairs recognised, of those tried; "
    "FP, false positives: independent pairs matched, of those tried",
)


def format_bench(results: BenchResults) -> str:
    """Return times and answers by matcher and model, then a summary; "-" where no cell was run."""
    blocks = [
        f"### {title}\n\n{markdown_table(lines, left=0)}" for title, lines in _tables(results)
    ]
    lists = ["\n".join(f"- {line}" for line in part) for part in (LEGEND, summarise(results))]
    return "\n\n".join([*blocks, *lists])


def _tables(results: BenchResults) -> list[tuple[str, list[Line]]]:
    """Return titles and lines of the two tables of each model and matcher: times and answers."""
    known = {(cell.condition.model, cell.matcher) for cell in results.cells}
    tables = []
    for model in POINT_MODELS:
        for matcher in [name for name in MATCHER_NAMES if (model, name) in known]:
            table, _ = _PUBLISHED.get(matcher, ("", ""))
            source = f", beside the paper's {table}" if table else ""
            title = f"{matcher}, {model} model"
            tables += [
                (f"{title}: times in ms{source}", _times(results, matcher, model)),
                (f"{title}: answers", _answers(results, matcher, model)),
            ]
    return tables


def _times(results: BenchResults, matcher: str, model: PointModel) -> list[Line]:
    _, published = _PUBLISHED.get(matcher, ("", ""))
    columns = ("median", "mean", *(["paper"] if published else []), "indep.")

    def measured(cell: PointCell | None, row: PaperRow, column: int) -> Line:
        paper = (format_ms(1e3 * getattr(row, published)[column]),) if published else ()
        if cell is None:
            return (_ABSENT, _ABSENT, *paper, _ABSENT)
        mean = _ABSENT if cell.mean_ms is None else format_ms(cell.mean_ms)
        return (format_ms(cell.time_ms), mean, *paper, format_ms(cell.independent_time_ms))

    return _lines(results, matcher, model, columns, measured)


def _answers(results: BenchResults, matcher: str, model: PointModel) -> list[Line]:
    def counted(cell: PointCell | None, *_: object) -> Line:
        if cell is None:
            return (_ABSENT, _ABSENT)
        false = f"{cell.false_positives}/{cell.independent_trials}"
        return (f"{cell.true_positives}/{cell.trials}", false)

    return _lines(results, matcher, model, ("TP", "FP"), counted)


def _lines(
    results: BenchResults,
    matcher: str,
    model: PointModel,
    columns: Line,
    texts: Callable[[PointCell | None, PaperRow, int], Line],
) -> list[Line]:
    """Return a head, and a line for each row of which any cell was run."""
    lines: list[Line] = [
        (*_PARAMETERS, *(f"n = {n}m: {name}" for n in TARGET_FACTORS for name in columns))
    ]
    for index, row in enumerate(PAPER_ROWS):
        cells = [
            results.cell(Condition(model, index, factor), matcher) for factor in TARGET_FACTORS
        ]
        if any(cells):
            line = [str(row.m), f"{row.rho:g}", f"{row.eta:g}", f"{row.lambda_:g}"]
            for column, cell in enumerate(cells):
                line += texts(cell, row, column)
            lines.append(tuple(line))
    return lines


def format_ms(milliseconds: float) -> str:
    """Return a time in milliseconds with about three digits, without its unit."""
    decimals = sum(float(f"{milliseconds:.3g}") < edge for edge in _EDGES)
    return f"{milliseconds:.{decimals}f}"

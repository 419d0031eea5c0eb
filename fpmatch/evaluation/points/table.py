"""The results on random point sets as tables beside the paper's own, for people."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.points.matchers import MATCHER_NAMES
from fpmatch.evaluation.points.places import Place
from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.evaluation.points.summary import summarise
from fpmatch.pointset.random_sets import READINGS

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.evaluation.points.published_results import PaperRow
    from fpmatch.evaluation.points.results import BenchResults, PointCell
    from fpmatch.pointset.random_sets import PointModel

    Line = tuple[str, ...]

_PUBLISHED: Final[dict[str, Callable[[PaperRow], tuple[float, ...]]]] = {
    "ours": lambda row: row.unit_circle_s,
    "paper": lambda row: row.unit_circle_s,
    "van-wamelen": lambda row: row.van_wamelen_s,
}
_SOURCE: Final = {"ours": "Table 2", "paper": "Table 2", "van-wamelen": "Table 1"}
_PARAMETERS: Final = ("m", "rho", "eta", "lambda")
_TIMES: Final = ("median", "mean", "indep.")
_ANSWERS: Final = ("right", "false")
_ABSENT: Final = "-"
_MS: Final = 1e3
_WIDTH: Final = 120
_EDGES: Final = (100.0, 10.0, 0.1)
"""Milliseconds below which a time has one decimal more."""

LEGEND: Final = (
    "median, mean: time of a match of a genuine pair from the bare points, ms; paper: the average "
    "time that the paper gives, ms; indep.: median time of a match of an independent pair, ms",
    "right: genuine pairs recognised, of those tried; "
    "false: matches claimed on independent pairs, of those tried",
)


def format_bench(results: BenchResults) -> str:
    """Return the results as plain text: times and answers a matcher and reading, then a summary.

    Parameters
    ----------
    results : BenchResults
        The results.

    Returns
    -------
    str
        Lines of at most 120 characters (for up to 100 trials); "-" where a cell was not run.
    """
    blocks = [
        "\n".join([title, *_as_text(lines)])
        for reading, matcher in _blocks(results)
        for title, lines in _tables(results, matcher, reading)
    ]
    notes = ["\n".join(map(_wrapped, part)) for part in (LEGEND, summarise(results))]
    return "\n\n".join([*blocks, *filter(None, notes)])


def format_bench_markdown(results: BenchResults) -> str:
    """Return the results as `format_bench` does, in Markdown."""
    blocks = [
        "\n".join([f"### {title}", "", *_as_markdown(lines)])
        for reading, matcher in _blocks(results)
        for title, lines in _tables(results, matcher, reading)
    ]
    lists = ["\n".join(f"- {line}" for line in part) for part in (LEGEND, summarise(results))]
    return "\n\n".join([*blocks, *lists])


def _blocks(results: BenchResults) -> list[tuple[PointModel, str]]:
    known = {(cell.place.reading, cell.matcher) for cell in results.cells}
    return [(r, name) for r in READINGS for name in MATCHER_NAMES if (r, name) in known]


def _tables(
    results: BenchResults, matcher: str, reading: PointModel
) -> list[tuple[str, list[Line]]]:
    """Return the titles and lines of a matcher's two tables: its times, and its answers."""
    source = f", beside the paper's {_SOURCE[matcher]}" if matcher in _SOURCE else ""
    return [
        (f"{matcher}, {reading} reading: times in ms{source}", _times(results, matcher, reading)),
        (f"{matcher}, {reading} reading: answers", _answers(results, matcher, reading)),
    ]


def _times(results: BenchResults, matcher: str, reading: PointModel) -> list[Line]:
    published = _PUBLISHED.get(matcher)
    columns = (*_TIMES[:2], "paper", *_TIMES[2:]) if published else _TIMES

    def measured(cell: PointCell | None, row: PaperRow, column: int) -> Line:
        paper = (format_ms(_MS * published(row)[column]),) if published else ()
        if cell is None:
            return (_ABSENT, _ABSENT, *paper, _ABSENT)
        mean = _ABSENT if cell.mean_ms is None else format_ms(cell.mean_ms)
        return (format_ms(cell.time_ms), mean, *paper, format_ms(cell.independent_time_ms))

    return _lines(results, matcher, reading, columns, measured)


def _answers(results: BenchResults, matcher: str, reading: PointModel) -> list[Line]:
    def counted(cell: PointCell | None, *_: object) -> Line:
        if cell is None:
            return (_ABSENT,) * len(_ANSWERS)
        false = f"{cell.false_matches}/{cell.independent_trials}"
        return (f"{cell.right}/{cell.trials}", false)

    return _lines(results, matcher, reading, _ANSWERS, counted)


def _lines(
    results: BenchResults,
    matcher: str,
    reading: PointModel,
    columns: Line,
    words: Callable[[PointCell | None, PaperRow, int], Line],
) -> list[Line]:
    """Return a head, and a line a row of which any cell was run."""
    lines: list[Line] = [(*_PARAMETERS, *(name for _ in TARGET_FACTORS for name in columns))]
    for index, row in enumerate(PAPER_ROWS):
        cells = [results.cell(Place(reading, index, factor), matcher) for factor in TARGET_FACTORS]
        if any(cells):
            line = [str(row.m), f"{row.rho:g}", f"{row.eta:g}", f"{row.lambda_:g}"]
            for column, cell in enumerate(cells):
                line += words(cell, row, column)
            lines.append(tuple(line))
    return lines


def format_ms(milliseconds: float) -> str:
    """Return a time in milliseconds with about three digits, without its unit.

    Parameters
    ----------
    milliseconds : float
        The time.

    Returns
    -------
    str
        The number.

    Examples
    --------
    >>> [format_ms(t) for t in (0.0123, 0.5, 12.34, 345.6, 20345.0)]
    ['0.012', '0.50', '12.3', '346', '20345']
    """
    decimals = sum(float(f"{milliseconds:.3g}") < edge for edge in _EDGES)
    return f"{milliseconds:.{decimals}f}"


def _wrapped(line: str) -> str:
    return textwrap.fill(line, _WIDTH, subsequent_indent="  ")


def _groups(width: int) -> list[tuple[str, int]]:
    """Return the heads over the columns of each n, and how many columns each has."""
    each = (width - len(_PARAMETERS)) // len(TARGET_FACTORS)
    return [(f"n = {factor}m", each) for factor in TARGET_FACTORS]


def _as_text(lines: list[Line]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    first = len(_PARAMETERS)
    over = ["  ".join(" " * width for width in widths[:first])]
    for index, (name, count) in enumerate(_groups(len(widths))):
        span = widths[first + index * count : first + (index + 1) * count]
        over.append(name.center(sum(span) + 2 * (count - 1), "-"))
    return [
        "  ".join(over),
        *("  ".join(map(str.rjust, line, widths)) for line in lines),
    ]


def _as_markdown(lines: list[Line]) -> list[str]:
    head, *rows = lines
    named = list(head[: len(_PARAMETERS)])
    for index, (name, count) in enumerate(_groups(len(head))):
        start = len(_PARAMETERS) + index * count
        named += [f"{name}: {column}" for column in head[start : start + count]]
    return [_pipes(named), _pipes(["---:"] * len(head)), *map(_pipes, rows)]


def _pipes(cells: list[str] | Line) -> str:
    return f"| {' | '.join(cells)} |"

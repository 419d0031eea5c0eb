"""The curves of open-set identification: as CSV files, for other programs, and as a plot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.output import atomic_write_bytes
from fpmatch.lab.evaluation.open_set.searches import LIST_LENGTH
from fpmatch.lab.evaluation.report import svg
from fpmatch.lab.evaluation.report.curves import writable_files, write_files
from fpmatch.lab.evaluation.report.det import IN_FILE, IN_PAGE
from fpmatch.lab.evaluation.report.figures import new_axes
from fpmatch.lab.plots.style import PLOT_DPI, check_plot, figure_bytes, plain_style
from fpmatch.printable import count

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from fpmatch.lab.evaluation.open_set.rates import OpenSetRates
    from fpmatch.lab.evaluation.open_set.report import IdentificationReport
    from fpmatch.lab.evaluation.report.det import Palette

    Row = tuple[object, ...]

DET, RANK = "identification_det.csv", "identification_rank.csv"
_WHOSE: Final = ("matcher", "set", "fingers")
HEADS: Final = {
    DET: (*_WHOSE, "fpir", "by_chance", "fnir", "fnir_low", "fnir_high", "stated_fnir"),
    RANK: (*_WHOSE, "rank", "fnir", "fnir_low", "fnir_high"),
}
"""The files and their columns."""
_PANEL_INCHES: Final = (5.2, 4.2)
_RANK_TICKS: Final = (1, 2, 5, 10, 20, 50, 100)


def prepare_identification_curves(folder: str | os.PathLike[str]) -> list[Path]:
    """Make a folder for the files of `write_identification_curves`, and return these.

    Raises an `OutputError` if they cannot be written there.
    """
    return writable_files(folder, HEADS)


def write_identification_curves(
    folder: str | os.PathLike[str], reports: Sequence[IdentificationReport]
) -> list[Path]:
    """Write DET and rank curves of each database, and of several all; return the files of `HEADS`.

    Raises an `OutputError` if a file cannot be written.
    """
    return write_files(folder, HEADS, {DET: _det_rows, RANK: _rank_rows}, reports)


def _det_rows(report: IdentificationReport) -> Iterator[Row]:
    for name, rates in report.rows():
        for one in rates.det:
            yield (
                *(report.matcher, name, report.fingers),
                *(one.fpir, one.by_chance, one.fnir, *(one.interval or ("", ""))),
                one.stated_fnir,
            )


def _rank_rows(report: IdentificationReport) -> Iterator[Row]:
    for name, rates in report.rows():
        both = zip(rates.fnir_at_rank, rates.rank_intervals, strict=True)
        for rank, (fnir, interval) in enumerate(both, start=1):
            yield (report.matcher, name, report.fingers, rank, fnir, *(interval or ("", "")))


def save_identification_plot(
    path: str | os.PathLike[str], reports: Sequence[IdentificationReport]
) -> None:
    """Draw FNIR against FPIR, and against the rank, of all searches of each report.

    Intervals are shaded, and the FNIR at the FPIR that the searches state is dashed. A rate of 0
    is drawn at half a search. Raises an `OutputError` as `check_plot`.
    """
    check_plot(path)
    from matplotlib.figure import Figure  # noqa: PLC0415

    with plain_style():
        size = 2 * _PANEL_INCHES[0], _PANEL_INCHES[1]
        det, ranks = (figure := Figure(figsize=size, layout="constrained")).subplots(1, 2)
        _draw(det, ranks, reports, IN_FILE)
        atomic_write_bytes(path, figure_bytes(figure, path, PLOT_DPI))


def identification_drawings(reports: Sequence[IdentificationReport]) -> list[tuple[str, str]]:
    """Return both plots of `save_identification_plot` for a page, with their captions."""
    with svg.settings():
        (det_figure, det), (rank_figure, ranks) = new_axes(), new_axes()
        _draw(det, ranks, reports, IN_PAGE)
        return [
            (
                svg.inline_svg(det_figure, "det", "DET curves"),
                "DET: FNIR against FPIR, of all searches. Shaded: 95 % intervals. A rate of 0 is "
                "drawn at half a search.",
            ),
            (
                svg.inline_svg(rank_figure, "ranks", "FNIR by rank"),
                "FNIR by rank, without a threshold: 1 − CMC (cumulative match characteristic).",
            ),
        ]


def _draw(
    det: Axes, ranks: Axes, reports: Sequence[IdentificationReport], palette: Palette
) -> None:
    most = 1
    for k, report in enumerate(reports):
        colour = palette.series(k)["color"]
        name = count(report.fingers, "finger")
        if len({one.matcher for one in reports}) > 1:
            name = f"{report.matcher}, {name}"
        _det(det, report.pooled, colour, name)
        most = max(most, listed := min(LIST_LENGTH, report.enrolled[1]))
        _rank(ranks, report.pooled, colour, name, listed)
    det.set(xlabel="FPIR, %", ylabel="FNIR, %", xscale="log", yscale="log")
    det.plot([], [], "--", color=palette.muted, label="at the stated FPIR")
    ranks.set(xlabel="rank", ylabel="FNIR without threshold, %", xscale="log", yscale="log")
    for axes in (det, ranks):
        axes.grid(visible=True, linewidth=0.4)
        axes.yaxis.set_minor_formatter("")
        axes.yaxis.set_major_formatter(lambda share, _: f"{100 * share:.6g}")
        axes.legend(frameon=False)
    det.xaxis.set_minor_formatter("")  # which has numbers where the axis is less than a decade
    det.xaxis.set_major_formatter(lambda share, _: f"{100 * share:.6g}")
    ranks.minorticks_off()
    ranks.set_xticks(shown := [r for r in _RANK_TICKS if r <= most], map(str, shown))


def _det(axes: Axes, rates: OpenSetRates, colour: str, name: str) -> None:
    known = [one for one in rates.det if one.fnir is not None]
    fpir = [one.fpir for one in known]
    _line(axes, fpir, [one.fnir for one in known], [one.interval for one in known], rates, colour)
    axes.lines[-1].set_label(name)
    stated = _visible([one.stated_fnir for one in rates.det], rates)
    axes.plot([one.fpir for one in rates.det], stated, "--", color=colour, linewidth=1)


def _rank(axes: Axes, rates: OpenSetRates, colour: str, name: str, most: int) -> None:
    ranks = np.arange(1, len(rates.fnir_at_rank[:most]) + 1)
    shown = rates.fnir_at_rank[:most], rates.rank_intervals[:most]
    _line(axes, ranks, *shown, rates, colour)
    axes.lines[-1].set_label(name)


def _line(
    axes: Axes, x: Any, y: Sequence[Any], intervals: Sequence[Any], rates: OpenSetRates, colour: str
) -> None:
    axes.plot(x, _visible(y, rates), color=colour, linewidth=1.6)
    if intervals and all(intervals):
        low, high = zip(*intervals, strict=True)
        axes.fill_between(
            x, _visible(low, rates), _visible(high, rates), color=colour, alpha=0.15, linewidth=0
        )


def _visible(shares: Sequence[Any], rates: OpenSetRates) -> Any:
    """Return shares of the searches with a mate, those of 0 as half a search."""
    return np.maximum(np.array(shares, np.float64), 0.5 / max(rates.mated, 1))

"""Plot the time of a match against the number of points, both on logarithmic scales."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.drawing.plots.style import figure_bytes, plain_style
from fpmatch.errors import OutputError
from fpmatch.evaluation.points.matchers import MATCHER_NAMES
from fpmatch.evaluation.points.places import places
from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.output import atomic_write_bytes, check_writable
from fpmatch.pointset.random_sets import READINGS

if TYPE_CHECKING:
    import os

    from fpmatch.evaluation.points.results import BenchResults, PointCell

PLOT_FORMATS: Final = (".png", ".svg", ".pdf")

# Told apart with any kind of colour vision, after Okabe and Ito, "Color Universal Design" (2008).
_COLOURS: Final = {
    "ours": "#0072b2",
    "paper": "#009e73",
    "van-wamelen": "#d55e00",
    "astroalign": "#cc79a7",
}
_SCIPY_COLOUR: Final = "#5f6368"
_MARKERS: Final = {2: "o", 4: "^", 8: "s"}
_PANEL_INCHES: Final = (4.0, 3.2)
_DPI: Final = 150


def check_plot(path: str | os.PathLike[str]) -> None:
    """Refuse a plot that could not be written, before hours of work go into it.

    Parameters
    ----------
    path : path-like
        The picture that is to be written later.

    Raises
    ------
    OutputError
        If its name ends with none of `PLOT_FORMATS`, it cannot be written, or matplotlib is not
        installed.
    """
    if Path(path).suffix.lower() not in PLOT_FORMATS:
        raise OutputError(f"{path}: a plot's name ends with {', '.join(PLOT_FORMATS)}")
    check_writable(path)
    try:
        import matplotlib  # noqa: F401, PLC0415
    except ImportError as error:
        raise OutputError(f"{path}: needs matplotlib: pip install 'fpmatch[plot]'") from error


def save_bench_plot(path: str | os.PathLike[str], results: BenchResults) -> None:
    """Draw a row of panels a reading, a panel a group of rows with the same ρ.

    Each matcher has a marker a cell, one shape for each n/m, and a line through those of n = 2m;
    scipy's triangulations of the same sets at n = 2m are a thin line.

    Parameters
    ----------
    path : path-like
        The picture, its format told by its ending; see `PLOT_FORMATS`.
    results : BenchResults
        The results.

    Raises
    ------
    OutputError
        As `check_plot`.
    """
    check_plot(path)
    from matplotlib.figure import Figure  # noqa: PLC0415

    with plain_style():
        readings = [r for r in READINGS if any(c.place.reading == r for c in results.cells)]
        shares = list(dict.fromkeys(row.rho for row in PAPER_ROWS))
        width, height = _PANEL_INCHES
        figure = Figure(
            figsize=(width * len(shares), height * max(1, len(readings)) + 0.6),
            layout="constrained",
        )
        if readings:
            panels = figure.subplots(
                len(readings), len(shares), sharex=True, sharey=True, squeeze=False
            )
            for reading, row in zip(readings, panels, strict=True):
                for rho, panel in zip(shares, row, strict=True):
                    cells = {
                        (cell.matcher, cell.place): cell
                        for cell in results.cells
                        if (cell.place.reading, cell.place.parameters.rho) == (reading, rho)
                    }
                    _fill(panel, cells)
                    panel.set_title(f"{reading} reading, ρ = {rho:g}", fontsize="medium")
                row[0].set_ylabel("time of a match, ms")
            for panel in panels[-1]:
                panel.set_xlabel("n, points of Q")
            _add_legend(figure, results)
        content = figure_bytes(figure, path, _DPI)
    atomic_write_bytes(path, content)


def _fill(panel: Any, cells: dict[Any, PointCell]) -> None:
    """Draw the times of one reading and one ρ."""
    panel.set_xscale("log", base=2)
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(lambda ms, _: f"{ms:,g}")
    sizes = sorted({place.n for place in places()})
    panel.set_xticks(sizes, labels=[f"{n:,}" for n in sizes], minor=False)
    panel.grid(visible=True, which="major", linewidth=0.4, color="#dadce0")
    for name in MATCHER_NAMES:
        own = [cells[name, place] for place in places() if (name, place) in cells]
        for factor in TARGET_FACTORS:
            drawn = [c for c in own if c.place.factor == factor]
            panel.plot(
                [cell.place.n for cell in drawn],
                [cell.time_ms for cell in drawn],
                marker=_MARKERS[factor],
                markersize=5 if factor == TARGET_FACTORS[0] else 3.5,
                markerfacecolor=_COLOURS[name] if factor == TARGET_FACTORS[0] else "white",
                linestyle="-" if factor == TARGET_FACTORS[0] else "",
                color=_COLOURS[name],
            )
    beside = {c.place.n: c for c in cells.values() if c.place.factor == TARGET_FACTORS[0]}
    panel.plot(
        sorted(beside),
        [beside[n].scipy_delaunay_ms for n in sorted(beside)],
        color=_SCIPY_COLOUR,
        linewidth=0.8,
        linestyle="--",
    )


def _add_legend(figure: Any, results: BenchResults) -> None:
    from matplotlib.lines import Line2D  # noqa: PLC0415

    known = {cell.matcher for cell in results.cells}
    handles = [
        *(Line2D([], [], color=_COLOURS[n], label=n) for n in MATCHER_NAMES if n in known),
        Line2D(
            [],
            [],
            color=_SCIPY_COLOUR,
            linewidth=0.8,
            linestyle="--",
            label="scipy, both triangulations (n = 2m)",
        ),
        *(
            Line2D(
                [],
                [],
                color="black",
                linestyle="",
                marker=marker,
                markerfacecolor="black" if factor == TARGET_FACTORS[0] else "white",
                label=f"n = {factor}m",
            )
            for factor, marker in _MARKERS.items()
        ),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)

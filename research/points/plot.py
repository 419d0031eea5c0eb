"""Plot the time of a match against the number of points, both on logarithmic scales."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write_bytes
from fpmatch.lab.plots.style import PLOT_DPI, SERIES_COLOURS, check_plot, figure_bytes, plain_style
from research.points.conditions import PAPER_ROWS, TARGET_FACTORS, conditions
from research.points.matchers import MATCHER_NAMES
from research.points.random_sets import POINT_MODELS

if TYPE_CHECKING:
    import os

    from research.points.results import BenchResults, PointCell

_COLOURS: Final = dict(
    zip(("triangles", "van-wamelen", "paper", "astroalign"), SERIES_COLOURS, strict=True)
)
_SCIPY_LINE: Final[Any] = {"color": "#5f6368", "linewidth": 0.8, "linestyle": "--"}
_MARKERS: Final = {2: "o", 4: "^", 8: "s"}
_PANEL_INCHES: Final = (4.0, 3.2)


def save_bench_plot(path: str | os.PathLike[str], results: BenchResults) -> None:
    """Draw a row of panels a model, a panel for each ρ; raise as `check_plot`."""
    check_plot(path)
    from matplotlib.figure import Figure  # noqa: PLC0415

    with plain_style():
        models = [r for r in POINT_MODELS if any(c.condition.model == r for c in results.cells)]
        shares = list(dict.fromkeys(row.rho for row in PAPER_ROWS))
        size = _PANEL_INCHES[0] * len(shares), _PANEL_INCHES[1] * max(1, len(models)) + 0.6
        figure = Figure(figsize=size, layout="constrained")
        if models:
            panels = figure.subplots(
                len(models), len(shares), sharex=True, sharey=True, squeeze=False
            )
            for model, row in zip(models, panels, strict=True):
                for rho, panel in zip(shares, row, strict=True):
                    cells = {
                        (cell.matcher, cell.condition): cell
                        for cell in results.cells
                        if (cell.condition.model, cell.condition.parameters.rho) == (model, rho)
                    }
                    _fill(panel, cells)
                    panel.set_title(f"{model} model, ρ = {rho:g}", fontsize="medium")
                row[0].set_ylabel("time of a match, ms")
            for panel in panels[-1]:
                panel.set_xlabel("n, points of Q")
            _add_legend(figure, results)
        content = figure_bytes(figure, path, PLOT_DPI)
    atomic_write_bytes(path, content, public=True)


def _fill(panel: Any, cells: dict[Any, PointCell]) -> None:
    """Draw the times of one model and one ρ."""
    panel.set_xscale("log", base=2)
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(lambda ms, _: f"{ms:,g}")
    sizes = sorted({condition.n for condition in conditions()})
    panel.set_xticks(sizes, labels=[f"{n:,}" for n in sizes], minor=False)
    panel.grid(visible=True, which="major", linewidth=0.4, color="#dadce0")
    for name in MATCHER_NAMES:
        own = [cells[name, condition] for condition in conditions() if (name, condition) in cells]
        for factor in TARGET_FACTORS:
            drawn = [c for c in own if c.condition.factor == factor]
            smallest = factor == TARGET_FACTORS[0]
            panel.plot(
                [cell.condition.n for cell in drawn],
                [cell.time_ms for cell in drawn],
                marker=_MARKERS[factor],
                markersize=5 if smallest else 3.5,
                markerfacecolor=_COLOURS[name] if smallest else "white",
                linestyle="-" if smallest else "",
                color=_COLOURS[name],
            )
    beside = {c.condition.n: c for c in cells.values() if c.condition.factor == TARGET_FACTORS[0]}
    sizes = sorted(beside)
    panel.plot(sizes, [beside[n].scipy_delaunay_ms for n in sizes], **_SCIPY_LINE)


def _add_legend(figure: Any, results: BenchResults) -> None:
    from matplotlib.lines import Line2D  # noqa: PLC0415

    known = {cell.matcher for cell in results.cells}
    handles = [
        *(Line2D([], [], color=_COLOURS[n], label=n) for n in MATCHER_NAMES if n in known),
        Line2D([], [], **_SCIPY_LINE, label="scipy, both triangulations (n = 2m)"),
    ]
    for factor, marker in _MARKERS.items():
        face = "black" if factor == TARGET_FACTORS[0] else "white"
        look: Any = {"marker": marker, "markerfacecolor": face, "label": f"n = {factor}m"}
        handles.append(Line2D([], [], color="black", linestyle="", **look))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)

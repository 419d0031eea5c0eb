"""The figures of the page, under one legend: rates, scores, ranks, and errors by quality."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.gallery.batch.decision import calibration_of
from fpmatch.lab.evaluation.rates.error_rates import error_curves
from fpmatch.lab.evaluation.report import svg
from fpmatch.lab.evaluation.report.det import (
    IN_PAGE,
    Curve,
    det_curves,
    draw_det,
    draw_line,
    in_percent,
)
from fpmatch.lab.evaluation.report.results import split_scores
from fpmatch.matching.decision import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.report.results import RatesReport


_SIZE: Final = (5.6, 4.4)  # inches; the page scales it
_ROC_LOWEST_FMR: Final = 1e-4
_BINS: Final = 50
_MOST_RANKS: Final = 10
_LEAST_SPAN: Final = 0.9  # axes of shares near 1 begin no higher
_DASHES: Final = {"-": "", "--": "6 3", "-.": "7 3 2 3", ":": "2 3"}


def det_plot(curves: Sequence[Curve], name: str) -> str:
    """Return the DET curves as `draw_det` draws them; `name` is as for `inline_svg`."""
    with svg.settings():
        figure, axes = new_axes()
        draw_det(axes, curves, IN_PAGE)
        return svg.inline_svg(figure, name, "DET curves")


def roc_plot(curves: Sequence[Curve], name: str) -> str:
    """Draw the share of genuine pairs that match against FMR; else as `det_plot`."""
    with svg.settings():
        figure, axes = new_axes()
        lowest = 1.0
        for index, curve in enumerate(curves):
            errors = error_curves(curve.genuine, curve.impostor)
            draw_line(axes, errors.fmr, 1 - errors.fnmr, index, curve, IN_PAGE)
            shown = errors.fmr >= _ROC_LOWEST_FMR
            lowest = min(lowest, float(1 - errors.fnmr[shown].max()))
        axes.set_xscale("log")
        ticks = [1e-4, 1e-3, 1e-2, 1e-1, 1.0]
        axes.set_xticks(ticks, [in_percent(t) for t in ticks])
        axes.minorticks_off()
        bottom = min(np.floor(lowest * 20) / 20, _LEAST_SPAN)
        axes.set(xlim=(_ROC_LOWEST_FMR, 1), ylim=(bottom, 1.002))
        axes.yaxis.set_major_formatter(lambda share, _: f"{100 * share:g}")
        axes.set(xlabel="false match rate, %", ylabel="genuine pairs that match, %")
        return svg.inline_svg(figure, name, "ROC curves")


def score_plot(curve: Curve, name: str, unit: str, threshold: float | None = None) -> str:
    """Draw the distributions of genuine and impostor scores, called `unit`; mark a threshold."""
    with svg.settings():
        figure, axes = new_axes()
        both = np.concatenate([curve.genuine, curve.impostor])
        edges = np.linspace(both.min(), max(both.max(), both.min() + 1e-9), _BINS + 1)
        for values, colour in ((curve.impostor, svg.IMPOSTOR), (curve.genuine, svg.GENUINE)):
            share = np.histogram(values, edges)[0] / values.size
            axes.stairs(share, edges, fill=True, color=colour, alpha=0.25)
            axes.stairs(share, edges, color=colour, linewidth=1.6)
        axes.set_yscale("log")
        axes.set_ylim(0.5 / max(curve.genuine.size, curve.impostor.size), 1)
        axes.yaxis.set_major_formatter(lambda share, _: in_percent(share))
        axes.minorticks_off()
        if threshold is not None:
            axes.axvline(threshold, color=svg.INK, linewidth=1, linestyle="--")
            axes.text(threshold, 1.02, " default threshold", transform=axes.get_xaxis_transform())
        axes.set(xlabel=unit, ylabel=f"pairs in each of {_BINS} bins, %")
        return svg.inline_svg(figure, name, "distributions of scores")


def rank_plot(shares: Sequence[tuple[str, NDArray[np.float64]]], name: str) -> str:
    """Draw the shares of probes whose own finger is at rank 1, 2, … or before, each with a name."""
    with svg.settings():
        figure, axes = new_axes()
        ranks = min(_MOST_RANKS, max(share.size for _, share in shares))
        for index, (_, share) in enumerate(shares):
            shown = share[:ranks]
            look = svg.series_look(index)
            axes.plot(np.arange(1, shown.size + 1), shown, marker="o", markersize=3.5, **look)
        lowest = min(float(share[0]) for _, share in shares)
        axes.set_ylim(min(np.floor(lowest * 20) / 20, _LEAST_SPAN), 1.005)
        axes.set_xticks(range(1, ranks + 1))
        axes.yaxis.set_major_formatter(lambda share, _: f"{100 * share:g}")
        axes.set(xlabel="rank", ylabel="own finger at this rank or before, %")
        return svg.inline_svg(figure, name, "cumulative match characteristic")


def new_axes() -> tuple[Figure, Axes]:
    """Return a figure of the page's size, and its axes."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=_SIZE, layout="constrained")
    return figure, figure.add_subplot()


class LegendLine(NamedTuple):
    """A line of a legend: its label, and its look as SVG attributes."""

    label: str
    colour: str
    dashes: str
    width: float


class Figures(NamedTuple):
    """A legend, and drawings as SVG elements with their captions."""

    legend: list[LegendLine]
    drawings: list[tuple[str, str]]


def matcher_figures(report: RatesReport, number: int) -> Figures:
    """Return the plots of one matcher, a line a database; `number` makes identifiers unique."""
    lines = det_curves([report])
    if not lines:
        return Figures([], [])
    drawings = [
        (
            det_plot(lines, f"det-{number}"),
            "DET on axes of normal deviates: FNMR against FMR; further to the lower left is "
            "better. Shaded: fewer than 30 false matches are left, and rates are unsure.",
        ),
        (roc_plot(lines, f"roc-{number}"), "ROC: genuine pairs that match, against FMR."),
        (_scores(report, number), "Scores of genuine pairs (green) and impostors (orange)."),
    ]
    identified = [(row.name, row.identification) for row in report.sets]
    ranks = [(name, one.match_characteristic()) for name, one in identified if one is not None]
    if ranks:
        caption = "CMC: how far down the list of all fingers a print’s own comes."
        drawings.append((rank_plot(ranks, f"cmc-{number}"), caption))
    legend = _legend([c.title for c in lines if not c.bold])
    if lines[-1].bold:
        legend.append(LegendLine(lines[-1].label, "ink", "", 3.0))
    return Figures(legend, drawings)


def pooled_figures(reports: Sequence[RatesReport]) -> Figures:
    """Return DET and ROC of several matchers; no drawings where a kind of pair is missing."""
    curves = det_curves(reports)
    if not curves:
        return Figures([], [])
    of = ", all scores pooled" if len(reports[0].sets) > 1 else ""
    return Figures(
        _legend([curve.label for curve in curves]),
        [(det_plot(curves, "det-all"), f"DET{of}"), (roc_plot(curves, "roc-all"), f"ROC{of}")],
    )


def _scores(report: RatesReport, number: int) -> str:
    name = f"scores-{number}"
    genuine, impostor = split_scores(report.sets)
    if report.sets[0].scores.distances:
        return score_plot(Curve("", -genuine, -impostor), name, "distance")
    calibration = calibration_of(report.matcher)
    if calibration is None:
        return score_plot(Curve("", genuine, impostor), name, "similarity")
    scored = Curve("", calibration.scores(genuine), calibration.scores(impostor))
    return score_plot(scored, name, "score", DEFAULT_THRESHOLD)


def _legend(labels: Sequence[str]) -> list[LegendLine]:
    return [
        LegendLine(label, svg.colour_name(svg.series_colour(k)), _DASHES[svg.series_dashes(k)], 2.0)
        for k, label in enumerate(labels)
    ]

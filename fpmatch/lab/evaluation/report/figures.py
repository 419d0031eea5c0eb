"""Figures of error rates: DET curves and distributions of scores, drawn by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import OutputError
from fpmatch.gallery.batch.score import calibration_of
from fpmatch.lab.evaluation.rates.error_rates import error_curves
from fpmatch.lab.evaluation.rates.scores import split
from fpmatch.lab.plots.style import SERIES_COLOURS, check_plot, plain_style, save_figure
from fpmatch.matching.decision import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.report.results import RatesReport

_SIZE: Final = (5.6, 4.4)  # inches
_TICKS: Final = (*(1e-5, 1e-4, 0.001, 0.005, 0.01, 0.02, 0.05), *(0.1, 0.2, 0.4, 0.6, 0.8))
_HIGHEST: Final = 0.6
_RULE_OF_30: Final = 30  # errors for a rate within 30 % (ISO/IEC 19795-1)
_DASHES: Final = ("-", "--", "-.", ":")
_GENUINE, _IMPOSTOR, _INK, _SHADE = "#00725a", "#b8441a", "#202124", "#eeeeee"
_BINS: Final = 50


class Curve(NamedTuple):
    """One line of a plot: scores, greater for more similar prints."""

    label: str
    genuine: NDArray[np.float64]
    impostor: NDArray[np.float64]


def det_curves(reports: Sequence[RatesReport]) -> list[Curve]:
    """Return a curve a matcher, of all scores pooled; of one matcher a curve a database, too.

    There are none where a matcher lacks a kind of pair, and none of a database that lacks one.
    """
    pooled = [Curve(report.matcher, *split(report.trials)) for report in reports]
    if not all(curve.genuine.size and curve.impostor.size for curve in pooled):
        return []
    if len(reports) > 1:
        return pooled
    curves = [Curve(row.name, *split([row.scores.trials])) for row in reports[0].sets]
    usable = [c for c in curves if c.genuine.size and c.impostor.size]
    return [*usable, pooled[0]._replace(label="all pooled")] if len(usable) > 1 else usable


def save_det(path: str | os.PathLike[str], reports: Sequence[RatesReport]) -> None:
    """Draw the DET curves of some matchers, all databases pooled; of one matcher, of each database.

    Raises an OutputError as `check_plot`, and where a kind of pair is missing.
    """
    check_plot(path)
    curves = det_curves(reports)
    if not curves:
        raise OutputError(f"{path}: a DET needs genuine and impostor pairs")
    with plain_style():
        save_figure(path, det_figure(curves))


def det_figure(curves: Sequence[Curve]) -> Figure:
    """Draw FNMR against FMR on axes of normal deviates, on which normal scores give a line.

    The last curve determines the shaded range of unsure rates. See Martin, Doddington, Kamm,
    Ordowski, Przybocki, "The DET curve in assessment of detection task performance", Eurospeech
    1997.
    """
    from scipy.special import ndtri  # noqa: PLC0415

    figure, axes = new_axes()
    low_x = min(0.5 / max(c.impostor.size for c in curves), 0.005)
    low_y = min(0.5 / max(c.genuine.size for c in curves), 0.005)
    for k, curve in enumerate(curves):
        fmr, fnmr = error_curves(curve.genuine, curve.impostor)
        x = ndtri(np.clip(fmr, low_x / 2, 1 - low_x / 2))
        y = ndtri(np.clip(fnmr, low_y / 2, 1 - low_y / 2))
        separates = curve.genuine.min() > curve.impostor.max()
        note = " (a threshold without errors: not in the DET)" * bool(separates)
        axes.plot(x, y, label=f"{curve.label}{note}", **series_look(k))
    unsure = _RULE_OF_30 / curves[-1].impostor.size
    axes.axvspan(ndtri(low_x), ndtri(max(unsure, low_x)), color=_SHADE, zorder=0)
    highest = ndtri(_HIGHEST)
    axes.plot([-9, highest], [-9, highest], color=_INK, linewidth=0.8, linestyle=":")
    for set_ticks, low in ((axes.set_xticks, low_x), (axes.set_yticks, low_y)):
        ticks = [t for t in _TICKS if low <= t <= _HIGHEST]
        set_ticks([float(ndtri(t)) for t in ticks], [f"{100 * t:.6g}" for t in ticks])
    axes.set(xlim=(ndtri(low_x), highest), ylim=(ndtri(low_y), highest))
    axes.set(xlabel="false match rate, %", ylabel="false non-match rate, %")
    axes.legend(frameon=False)
    return figure


def score_figure(report: RatesReport) -> Figure:
    """Draw the distributions of genuine and impostor scores, with the default threshold."""
    genuine, impostor = split(report.trials)
    unit, calibration = "similarity", calibration_of(report.matcher)
    if report.sets[0].scores.distances:
        genuine, impostor, unit = -genuine, -impostor, "distance"
    elif calibration is not None:
        genuine, impostor = calibration.scores(genuine), calibration.scores(impostor)
        unit = "score"
    figure, axes = new_axes()
    both = np.concatenate([genuine, impostor])
    edges = np.linspace(both.min(), max(both.max(), both.min() + 1e-9), _BINS + 1)
    kinds = ((impostor, "impostor", _IMPOSTOR), (genuine, "genuine", _GENUINE))
    for values, label, colour in kinds:
        share = np.histogram(values, edges)[0] / values.size
        axes.stairs(share, edges, fill=True, color=colour, alpha=0.25)
        axes.stairs(share, edges, color=colour, linewidth=1.6, label=label)
    axes.set_yscale("log")
    axes.set_ylim(0.5 / max(genuine.size, impostor.size), 1)
    axes.yaxis.set_major_formatter(lambda share, _: f"{100 * share:.6g}")
    axes.minorticks_off()
    if unit == "score":
        axes.axvline(DEFAULT_THRESHOLD, color=_INK, linewidth=1, linestyle="--")
        up = axes.get_xaxis_transform()
        axes.text(DEFAULT_THRESHOLD, 1.02, " default threshold", transform=up)
    axes.set(xlabel=unit, ylabel=f"pairs in each of {_BINS} bins, %")
    axes.legend(frameon=False)
    return figure


def series_look(index: int) -> dict[str, Any]:
    """Return colour and dashes of a line by its number."""
    colour = SERIES_COLOURS[index % len(SERIES_COLOURS)]
    return {"color": colour, "linestyle": _DASHES[index // len(SERIES_COLOURS) % len(_DASHES)]}


def new_axes() -> tuple[Figure, Axes]:
    """Return a figure, and its axes."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=_SIZE, layout="constrained")
    return figure, figure.add_subplot()

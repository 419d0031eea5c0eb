"""The figures of the page: several plots under one legend."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.evaluation.decision import calibration_of
from fpmatch.evaluation.html import svg
from fpmatch.evaluation.html.curves import Curve, det_plot, rank_plot, roc_plot, score_plot
from fpmatch.evaluation.report import pooled
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.report import EvaluationReport

_POOLED: Final = "all pooled"
_DASHES: Final = {"-": "", "--": "6 3", "-.": "7 3 2 3", ":": "2 3"}


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


def matcher_figures(report: EvaluationReport, number: int) -> Figures:
    """Return the plots of one matcher, a line a database; `number` makes identifiers unique."""
    curves = [Curve(row.name, *pooled([row])) for row in report.sets]
    usable = [c for c in curves if c.genuine.size and c.impostor.size]
    if not usable:
        return Figures([], [])
    several = len(usable) > 1
    lines = [*usable, Curve(_POOLED, *pooled(report.sets), bold=True)] if several else usable
    drawings = [
        (
            det_plot(lines, f"det-{number}"),
            "DET on axes of normal deviates: FNMR against FMR; further to the lower left is "
            "better. Shaded: fewer than 30 false matches are left, and rates are unsure.",
        ),
        (roc_plot(lines, f"roc-{number}"), "ROC: genuine pairs that match, against FMR."),
        (_scores(report, number), "Scores of genuine pairs (green) and impostors (orange)."),
    ]
    found = [(row.name, row.identification) for row in report.sets]
    ranks = [(name, one.match_characteristic()) for name, one in found if one is not None]
    if ranks:
        caption = "CMC: how far down the list of all fingers a print’s own comes."
        drawings.append((rank_plot(ranks, f"cmc-{number}"), caption))
    labels = [
        f"{c.label} (a threshold without errors: not in the DET)" if c.separates else c.label
        for c in usable
    ]
    legend = _legend(labels)
    if several:
        legend.append(LegendLine(_POOLED, "ink", "", 3.0))
    return Figures(legend, drawings)


def pooled_figures(reports: Sequence[EvaluationReport]) -> Figures:
    """Return DET and ROC of several matchers; no drawings where a kind of pair is missing."""
    curves = [Curve(report.matcher, *pooled(report.sets)) for report in reports]
    if any(not (curve.genuine.size and curve.impostor.size) for curve in curves):
        return Figures([], [])
    return Figures(
        _legend([curve.label for curve in curves]),
        [
            (det_plot(curves, "det-all"), "DET, all scores pooled"),
            (roc_plot(curves, "roc-all"), "ROC, all scores pooled"),
        ],
    )


def _scores(report: EvaluationReport, number: int) -> str:
    name = f"scores-{number}"
    genuine, impostor = pooled(report.sets)
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

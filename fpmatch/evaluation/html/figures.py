"""The figures of the page: several plots under one legend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.html import svg
from fpmatch.evaluation.html.curves import Curve, det_plot, rank_plot, roc_plot, score_plot
from fpmatch.matching.calibration import calibrated_matchers, load_calibration
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.report import EvaluationReport, SetResult

_POOLED: Final = "all pooled"
_DASHES: Final = {"-": "", "--": "6 3", "-.": "7 3 2 3", ":": "2 3"}


@dataclass(frozen=True, slots=True)
class LegendLine:
    """Hold a line of a legend: its label, and its look as SVG attributes."""

    label: str
    colour: str
    dashes: str
    width: float


@dataclass(frozen=True, slots=True)
class Figures:
    """Hold a legend, and drawings as SVG elements with their captions."""

    legend: list[LegendLine]
    drawings: list[tuple[str, str]]


def matcher_figures(report: EvaluationReport, number: int) -> Figures:
    """Return the plots of one matcher, a line a database; `number` makes identifiers unique."""
    curves = [_curve([row], row.name) for row in report.sets]
    usable = [c for c in curves if c.genuine.size and c.impostor.size]
    if not usable:
        return Figures([], [])
    several = len(usable) > 1
    lines = [*usable, _curve(report.sets, _POOLED, bold=True)] if several else usable
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
    curves = [pooled_curve(report, report.matcher) for report in reports]
    if any(not (curve.genuine.size and curve.impostor.size) for curve in curves):
        return Figures([], [])
    return Figures(
        _legend([curve.label for curve in curves]),
        [
            (det_plot(curves, "det-all"), "DET, all scores pooled"),
            (roc_plot(curves, "roc-all"), "ROC, all scores pooled"),
        ],
    )


def pooled_curve(report: EvaluationReport, label: str = "") -> Curve:
    """Return the similarities of all databases together."""
    return _curve(report.sets, label)


def _curve(rows: Sequence[SetResult], label: str, *, bold: bool = False) -> Curve:
    genuine = np.concatenate([row.pairs.genuine for row in rows])
    similarity = np.concatenate([row.outcomes["similarity"] for row in rows])
    return Curve(label, similarity[genuine], similarity[~genuine], bold)


def _scores(report: EvaluationReport, number: int) -> str:
    pooled = pooled_curve(report)
    if report.matcher not in calibrated_matchers():
        return score_plot(pooled, f"scores-{number}", "similarity")
    calibration = load_calibration(report.matcher)
    scored = Curve("", calibration.scores(pooled.genuine), calibration.scores(pooled.impostor))
    return score_plot(scored, f"scores-{number}", "score", DEFAULT_THRESHOLD)


def _legend(labels: Sequence[str]) -> list[LegendLine]:
    return [
        LegendLine(label, svg.colour_name(svg.series_colour(k)), _DASHES[svg.series_dashes(k)], 2.0)
        for k, label in enumerate(labels)
    ]

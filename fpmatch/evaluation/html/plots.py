"""The plots of the page, several under one legend."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.html import svg
from fpmatch.evaluation.html.curves import Curve, det_plot, rank_plot, roc_plot, score_plot
from fpmatch.evaluation.html.markup import Html, element, paragraph, text
from fpmatch.matching.calibration import calibrated_matchers, load_calibration
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.report import EvaluationReport

_POOLED: Final = "all pooled"
_DASHES: Final = {"-": "", "--": "6 3", "-.": "7 3 2 3", ":": "2 3"}


def matcher_plots(report: EvaluationReport, number: int) -> list[Html]:
    """Return the plots of one matcher, a line a database; `number` tells them from another's."""
    curves = [curve_of(report, [k], row.name) for k, row in enumerate(report.sets)]
    usable = [c for c in curves if c.genuine.size and c.impostor.size]
    if not usable:
        return [paragraph("No curves: a database needs genuine and impostor pairs.", class_="note")]
    several = len(usable) > 1
    lines = [*usable, pooled_curve(report, _POOLED, bold=True)] if several else list(usable)
    found = [(row.name, row.identification) for row in report.sets]
    ranks = [(name, one.match_characteristic()) for name, one in found if one is not None]
    figures = [
        figure(
            det_plot(lines, f"det-{number}"),
            "DET on axes of normal deviates: FNMR against FMR; further to the lower left is "
            "better. Shaded: fewer than 30 false matches are left, and rates are unsure.",
        ),
        figure(roc_plot(lines, f"roc-{number}"), "ROC: genuine pairs that match, against FMR."),
        figure(_scores(report, number), "Scores of genuine pairs (green) and impostors (orange)."),
    ]
    if ranks:
        figures.append(
            figure(
                rank_plot(ranks, f"cmc-{number}"),
                "CMC: how far down the list of all fingers a print’s own comes.",
            )
        )
    labels = [
        f"{curve.label} (a threshold without errors: not in the DET)"
        if curve.separates
        else curve.label
        for curve in usable
    ]
    return [
        legend(labels, strong=_POOLED if several else ""),
        element("div", *figures, class_="plots"),
    ]


def pooled_plots(curves: Sequence[Curve]) -> list[Html]:
    """Return DET and ROC of several matchers; nothing where a kind of pair is missing."""
    if any(not (curve.genuine.size and curve.impostor.size) for curve in curves):
        return []
    return [
        legend([curve.label for curve in curves]),
        element(
            "div",
            figure(det_plot(curves, "det-all"), "DET, all scores pooled"),
            figure(roc_plot(curves, "roc-all"), "ROC, all scores pooled"),
            class_="plots",
        ),
    ]


def _scores(report: EvaluationReport, number: int) -> str:
    pooled = pooled_curve(report)
    if report.matcher not in calibrated_matchers():
        return score_plot(pooled, f"scores-{number}", "similarity")
    calibration = load_calibration(report.matcher)
    scored = Curve("", calibration.scores(pooled.genuine), calibration.scores(pooled.impostor))
    return score_plot(scored, f"scores-{number}", "score", DEFAULT_THRESHOLD)


def curve_of(
    report: EvaluationReport, sets: Sequence[int], label: str, *, bold: bool = False
) -> Curve:
    """Return the scores of some databases together."""
    rows = [report.sets[k] for k in sets]
    genuine = np.concatenate([row.pairs.genuine for row in rows])
    similarity = np.concatenate([row.outcomes["similarity"] for row in rows])
    return Curve(label, similarity[genuine], similarity[~genuine], bold)


def pooled_curve(report: EvaluationReport, label: str = "", *, bold: bool = False) -> Curve:
    """Return the scores of all databases together."""
    return curve_of(report, range(len(report.sets)), label, bold=bold)


def figure(drawing: str, caption: str) -> Html:
    """Return a drawing with words below it."""
    return element("figure", Html(drawing), element("figcaption", text(caption)))


def legend(labels: Sequence[str], strong: str = "") -> Html:
    """Return which line is whose; `strong` is called the one that stands out."""
    items = [
        (svg.colour_name(svg.series_colour(k)), _DASHES[svg.series_dashes(k)], 2.0, label)
        for k, label in enumerate(labels)
    ]
    if strong:
        items.append(("ink", "", 3.0, strong))
    return element(
        "ul",
        *(
            element(
                "li",
                Html(
                    f'<svg viewBox="0 0 36 10" aria-hidden="true"><path d="M1 5H35" '
                    f'stroke="var(--{colour})" stroke-width="{width}" '
                    f'stroke-dasharray="{dashes}"/></svg>'
                ),
                text(label),
            )
            for colour, dashes, width, label in items
        ),
        class_="legend",
    )

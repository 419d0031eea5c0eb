"""The figures of errors by quality and overlap: error versus discard, and bars of FNMR."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.lab.evaluation.rates.error_rates import POOLED
from fpmatch.lab.evaluation.rates.error_vs_discard import SHARES
from fpmatch.lab.evaluation.report import svg
from fpmatch.lab.evaluation.report.det import in_percent
from fpmatch.lab.evaluation.report.figures import new_axes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.lab.evaluation.report.quality import ErrorBin, QualityAnalysis


def quality_drawings(analysis: QualityAnalysis | None, number: int) -> list[tuple[str, str]]:
    """Return the drawings with their captions; `number` makes identifiers unique."""
    if analysis is None:
        return []
    at = f"at an FMR of {100 * analysis.fmr:g} %"
    drawings = []
    if analysis.curves:
        caption = (
            f"Error versus discard: FNMR {at} where the prints of lowest quality are discarded. A "
            "curve that falls means that quality predicts errors."
        )
        if len(analysis.curves) > 1:
            caption += " Lines as above."
        drawings.append((_discard_plot(analysis, f"discard-{number}"), caption))
    if analysis.by_quality:
        plot = _bar_plot(analysis.by_quality, f"quality-{number}", "quality of the worse print", 1)
        drawings.append((plot, f"FNMR {at} by the quality of the worse print of a pair."))
    if analysis.by_overlap:
        plot = _bar_plot(
            analysis.by_overlap, f"overlap-{number}", "overlap, % of smaller print", 100
        )
        caption = "by how much of the smaller print overlaps, as the matcher placed the two"
        drawings.append((plot, f"FNMR {at} {caption}."))
    return drawings


def _discard_plot(analysis: QualityAnalysis, name: str) -> str:
    with svg.settings():
        figure, axes = new_axes()
        highest = 0.0
        for index, curve in enumerate(analysis.curves):
            pooled = curve.name == POOLED and len(analysis.curves) > 1
            look = {"color": svg.INK, "linewidth": 2.4} if pooled else svg.series_look(index)
            left = np.array(curve.genuine) > 0
            fnmr = np.array(curve.fnmr)[left]
            axes.plot(np.array(SHARES)[left], fnmr, marker="o", markersize=3.5, **look)
            highest = max(highest, float(fnmr.max(initial=0.0)))
        axes.set_ylim(0, 1.08 * highest or 0.01)
        axes.set_xticks(SHARES, [in_percent(share) for share in SHARES])
        axes.yaxis.set_major_formatter(lambda share, _: in_percent(share))
        axes.set(xlabel="prints discarded, %", ylabel="false non-match rate, %")
        return svg.inline_svg(figure, name, "error versus discard curves")


def _bar_plot(bins: Sequence[ErrorBin], name: str, unit: str, factor: float) -> str:
    """Draw the FNMR of each bin as a bar, with the numbers of pairs lost and compared above it."""
    with svg.settings():
        figure, axes = new_axes()
        places = np.arange(len(bins))
        heights = [one.fnmr or 0.0 for one in bins]
        axes.bar(places, heights, 0.7, color=svg.GENUINE, alpha=0.55)
        highest = max(heights)
        for place, one, height in zip(places, bins, heights, strict=True):
            text = f"{one.lost:,} of {one.genuine:,}" if one.genuine else "no pairs"
            axes.annotate(text, (place, height), (0, 3), textcoords="offset points", ha="center")
        axes.set_axisbelow(True)
        axes.set_ylim(0, 1.15 * highest or 0.01)
        labels = [f"{factor * one.low:g} to {factor * one.high:g}" for one in bins]
        axes.set_xticks(places, labels)
        axes.yaxis.set_major_formatter(lambda share, _: in_percent(share))
        axes.set(xlabel=unit, ylabel="false non-match rate, %")
        return svg.inline_svg(figure, name, f"false non-match rate by {unit}")

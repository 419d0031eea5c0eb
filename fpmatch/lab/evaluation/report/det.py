"""Curves of scores, and the DET of several, in the look of a page or of a file of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.rates.error_rates import error_curves
from fpmatch.lab.evaluation.report import svg
from fpmatch.lab.evaluation.report.results import split_scores
from fpmatch.lab.plots.style import SERIES_COLOURS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.report.results import RatesReport

POOLED: Final = "all pooled"
_DET_TICKS: Final = (*(1e-5, 1e-4, 0.001, 0.005, 0.01, 0.02, 0.05), *(0.1, 0.2, 0.4, 0.6, 0.8))
_DET_HIGHEST: Final = 0.6
_RULE_OF_30: Final = 30  # errors for a rate within 30 % (ISO/IEC 19795-1)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One line of a plot: scores, greater for more similar prints; `bold` stands out."""

    label: str
    genuine: NDArray[np.float64]
    impostor: NDArray[np.float64]
    bold: bool = False

    @property
    def separates(self) -> bool:
        """Whether some threshold makes no error; the DET then has nothing to show."""
        return bool(self.genuine.min() > self.impostor.max())

    @property
    def title(self) -> str:
        """The label, with a note where the DET has nothing to show."""
        note = " (a threshold without errors: not in the DET)" * self.separates
        return f"{self.label}{note}"


@dataclass(frozen=True, slots=True)
class Palette:
    """The look of a plot: of its lines by their number, and the colours of all else."""

    series: Callable[[int], dict[str, Any]]
    ink: str
    muted: str
    shade: str


IN_PAGE: Final = Palette(svg.series_look, svg.INK, svg.MUTED, svg.SHADE)
IN_FILE: Final = Palette(
    lambda k: {"color": SERIES_COLOURS[k % len(SERIES_COLOURS)], "linestyle": svg.series_dashes(k)},
    "#202124",
    "#5f6368",
    "#eeeeee",
)


def draw_det(axes: Axes, curves: Sequence[Curve], palette: Palette = IN_FILE) -> None:
    """Draw FNMR against FMR on axes of normal deviates, on which normal scores give a line.

    The last curve determines the shaded range of unsure rates. See Martin, Doddington, Kamm,
    Ordowski, Przybocki, "The DET curve in assessment of detection task performance", Eurospeech
    1997.
    """
    from scipy.special import ndtri  # noqa: PLC0415

    low_x = min(0.5 / max(c.impostor.size for c in curves), 0.005)
    low_y = min(0.5 / max(c.genuine.size for c in curves), 0.005)
    for index, curve in enumerate(curves):
        errors = error_curves(curve.genuine, curve.impostor)
        x = ndtri(np.clip(errors.fmr, low_x / 2, 1 - low_x / 2))
        y = ndtri(np.clip(errors.fnmr, low_y / 2, 1 - low_y / 2))
        draw_line(axes, x, y, index, curve, palette)
    unsure = _RULE_OF_30 / curves[-1].impostor.size
    axes.axvspan(ndtri(low_x), ndtri(max(unsure, low_x)), color=palette.shade, zorder=0)
    highest = ndtri(_DET_HIGHEST)
    axes.plot([-9, highest], [-9, highest], color=palette.muted, linewidth=0.8, linestyle=":")
    for set_ticks, low in ((axes.set_xticks, low_x), (axes.set_yticks, low_y)):
        ticks = [t for t in _DET_TICKS if low <= t <= _DET_HIGHEST]
        set_ticks([float(ndtri(t)) for t in ticks], [in_percent(t) for t in ticks])
    axes.set(xlim=(ndtri(low_x), highest), ylim=(ndtri(low_y), highest))
    axes.set(xlabel="false match rate, %", ylabel="false non-match rate, %")


def det_curves(reports: Sequence[RatesReport]) -> list[Curve]:
    """Return a curve a matcher, of all scores pooled; of one matcher a curve a database, too.

    There are none where a matcher lacks a kind of pair, and none of a database that lacks one.
    """
    pooled = [Curve(report.matcher, *split_scores(report.sets)) for report in reports]
    if not all(curve.genuine.size and curve.impostor.size for curve in pooled):
        return []
    if len(reports) > 1:
        return pooled
    curves = [Curve(row.name, *split_scores([row])) for row in reports[0].sets]
    usable = [c for c in curves if c.genuine.size and c.impostor.size]
    return [*usable, replace(pooled[0], label=POOLED, bold=True)] if len(usable) > 1 else usable


def draw_line(
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    index: int,
    curve: Curve,
    palette: Palette,
) -> None:
    """Draw a line in the look of its number, or in ink where it is bold."""
    look: Any = palette.series(index)
    if curve.bold:
        look = {"color": palette.ink, "linewidth": 2.4}
    axes.plot(x, y, **look)


def in_percent(share: float) -> str:
    """Write a share in percent without needless digits."""
    return f"{100 * share:.6g}"

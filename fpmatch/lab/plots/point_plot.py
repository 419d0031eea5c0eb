"""A plot of two point sets: P, moved onto Q; side by side where there is no match.

It needs matplotlib, which the extra ``fpmatch[plot]`` installs; y points up.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.output import atomic_write_bytes
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.palette import hexadecimal
from fpmatch.lab.plots.style import (
    PLOT_DPI,
    check_plot,
    figure_bytes,
    match_facts,
    plain_style,
    short_name,
)
from fpmatch.prints.report import verdict

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.point_match import PointMatch

    Floats = NDArray[np.float64]

_WIDTH, _HEIGHT, _HEIGHT_APART = 9.0, 8.0, 5.0  # inches
# Marker, colour, size as a share of a point's room, filled.
_Q_PAIRED: Final = ("o", palette.REFERENCE_MARK, 1.5, False)
_Q_ALONE: Final = ("s", palette.REFERENCE_INK, 0.7, False)
_P_PAIRED: Final = ("o", palette.PROBE_MARK, 0.6, True)
_P_ALONE: Final = ("x", palette.PROBE_INK, 0.7, False)


def save_point_plot(
    path: str | os.PathLike[str],
    p: Floats,
    q: Floats,
    match: PointMatch,
    *,
    names: tuple[str, str] = ("P", "Q"),
) -> None:
    """Draw Q (M, 2), and P (N, 2) moved onto it, with pairs linked; apart where there is no match.

    `match` is the result of `fpmatch.match_points`, `names` are those of the sets. Raises the
    errors of `check_plot`; no file is left behind then.
    """
    check_plot(path)
    with plain_style():
        figure = _draw(p, q, match, [short_name(name) for name in names])
        content = figure_bytes(figure, path, PLOT_DPI)
    atomic_write_bytes(path, content, public=True)


def _draw(p: Floats, q: Floats, match: PointMatch, names: list[str]) -> Figure:
    from matplotlib.collections import LineCollection  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    t = match.transform
    figure = Figure((_WIDTH, _HEIGHT_APART if t is None else _HEIGHT), layout="constrained")
    colour = hexadecimal(palette.NO_MATCH if t is None else palette.MATCH)
    figure.suptitle(verdict(t is not None), color=colour, weight="bold", fontsize="x-large")
    if t is None:
        for axes, points, mark, letter, name in zip(
            figure.subplots(1, 2), (p, q), (_P_PAIRED, _Q_PAIRED), "PQ", names, strict=True
        ):
            _axes(axes, f"{letter} ({name}): {len(points):,} points", [(points, mark, "")])
        return figure
    i, j = match.pairs.T
    moved, axes = t.apply(p), figure.subplots()
    facts = [f"P ({names[0]}), {'mirrored and ' * t.mirrored}moved, on Q ({names[1]})"]
    facts += [f"{label}: {value}" for label, value in match_facts(match)]
    kinds = [
        (q[j], _Q_PAIRED, "Q, paired"),
        (np.delete(q, j, axis=0), _Q_ALONE, "Q, unpaired"),
        (moved[i], _P_PAIRED, "P, moved, paired"),
        (np.delete(moved, i, axis=0), _P_ALONE, "P, moved, unpaired"),
    ]
    links, colour = np.stack([moved[i], q[j]], axis=1), hexadecimal(palette.PAIR_LINK)
    axes.add_collection(LineCollection(list(links), colors=colour, zorder=3))
    _axes(axes, "\n".join(facts), kinds)
    figure.legend(loc="outside lower left", ncols=2, frameon=False)
    return figure


def _axes(
    axes: Axes, title: str, kinds: list[tuple[Floats, tuple[str, palette.Colour, float, bool], str]]
) -> None:
    """Draw kinds of points."""
    size = float(np.clip(200 / math.sqrt(sum(len(points) for points, *_ in kinds) + 1), 0.4, 8.0))
    for points, (marker, colour_of, share, filled), label in kinds:
        colour = hexadecimal(colour_of)
        axes.plot(
            *points.T, marker, markersize=share * size, markeredgecolor=colour,
            markerfacecolor=colour if filled else "none", markeredgewidth=max(size / 8, 0.45),
            zorder=4, label=label and f"{label} ({len(points):,})",
        )  # fmt: skip
    axes.set_title(title, fontsize="medium", loc="left")
    axes.set(aspect="equal", axisbelow=True, xlabel="x", ylabel="y")
    axes.grid(color="0.92")

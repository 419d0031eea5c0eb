"""A plot of two point sets: P, moved onto Q; side by side where there is no match.

It needs matplotlib, which the extra ``fpmatch[plot]`` installs; y points up.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.palette import Colour, hexadecimal
from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import check_matplotlib, figure_bytes, match_facts, plain_style
from fpmatch.pointset.geometry.points import as_points
from fpmatch.prints.report import verdict

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.geometry.point_match import PointMatch

    Floats = NDArray[np.float64]

_STYLE: Final = {"figure.constrained_layout.h_pad": 0.1, "figure.constrained_layout.w_pad": 0.1}
SUFFIXES: Final = (".png", ".svg")
_DPI: Final = 150
# In inches: size of the axes, space around them, and height of a line of text.
_WIDTH, _LEAST_HEIGHT, _MOST_HEIGHT = 8.0, 2.5, 9.0
_SIDES, _AROUND, _LEGEND, _LINE = 1.2, 1.8, 0.6, 0.2
# In points; the size of a mark is a share of the mean spacing, within limits.
_MARK_SHARE, _LEAST_MARK, _MOST_MARK = 0.4, 0.4, 8.0
_LEGEND_MARK, _LEAST_LINE = 6.0, 0.45
_MOST_VECTORS: Final = 50_000  # marks; an SVG holds more of them as one image
_NAME_LETTERS: Final = 30
_PLAIN_EXPONENT: Final = 20  # coordinates beyond 1e±20 are drawn in a unit that tames them
_LEAST_EXPONENT: Final = -300


class _Mark(NamedTuple):
    """The marker of matplotlib that draws points of one kind."""

    marker: str
    colour: Colour
    size: float
    filled: bool
    order: int


_Q_PAIRED: Final = _Mark("o", palette.REFERENCE_MARK, 1.5, filled=False, order=2)
_LINK_ORDER: Final = 3
_P_PAIRED: Final = _Mark("o", palette.PROBE_MARK, 0.6, filled=True, order=4)
_Q_ALONE: Final = _Mark("s", palette.REFERENCE_INK, 0.7, filled=False, order=5)
_P_ALONE: Final = _Mark("x", palette.PROBE_INK, 0.9, filled=False, order=6)
_APART: Final = (
    _Mark("o", palette.PROBE_MARK, 0.8, filled=True, order=2),
    _Mark("o", palette.REFERENCE_MARK, 0.8, filled=True, order=2),
)


def check_plot(path: str | os.PathLike[str]) -> None:
    """Raise an `OutputError` for a plot that could not be made, before the work begins.

    The ending must be ``.png`` or ``.svg``, the file writable and matplotlib installed.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise OutputError(f"{path}: a plot is written as .png or .svg")
    check_matplotlib(f"{path}: a plot")
    check_writable(path)


def save_point_plot(
    path: str | os.PathLike[str],
    p: ArrayLike,
    q: ArrayLike,
    match: PointMatch,
    *,
    names: tuple[str, str] = ("P", "Q"),
) -> None:
    """Draw Q (M, 2), and P (N, 2) moved onto it, with pairs linked; apart where there is no match.

    `match` is the result of `fpmatch.match_points`, `names` are those of the sets. Errors are those
    of `check_plot`, and a `PointSetError` for a malformed set; no file is left behind then.
    """
    check_plot(path)
    source, target = as_points(p, "p"), as_points(q, "q")
    with plain_style(_STYLE):
        if match.transform is None:
            figure = _apart(source, target, names)
        else:
            figure = _superposed(match.transform.apply(source), target, match, names)
        content = figure_bytes(figure, path, _DPI)
    atomic_write_bytes(path, content, public=True)


def _superposed(moved: Floats, q: Floats, match: PointMatch, names: tuple[str, str]) -> Figure:
    """Draw the sets over each other."""
    unit = _unit(moved, q)
    moved, q = moved / unit, q / unit
    width, height = np.ptp(np.vstack([moved, q]), axis=0).tolist()
    high = _WIDTH * height / width if width > 0 else _MOST_HEIGHT
    how = "mirrored and moved" if match.transform and match.transform.mirrored else "moved"
    title = f"{_title('P', names[0])}, {how}, on {_title('Q', names[1])}"
    facts = [title, *(f"{label}: {value}" for label, value in match_facts(match))]
    figure = _figure(high + len(facts) * _LINE, verdict(True), palette.MATCH)
    axes = figure.subplots()
    muted = hexadecimal(palette.TEXT_MUTED)
    axes.set_title("\n".join(facts), loc="left", fontsize="medium", color=muted)
    rows_p, rows_q = match.pairs.T
    size = _mark_size(high, max(len(moved), len(q)))
    for points, mark, words in (
        (q[rows_q], _Q_PAIRED, "Q, paired"),
        (np.delete(q, rows_q, axis=0), _Q_ALONE, "Q, unpaired"),
        (moved[rows_p], _P_PAIRED, "P, moved, paired"),
        (np.delete(moved, rows_p, axis=0), _P_ALONE, "P, moved, unpaired"),
    ):
        _draw(axes, points, mark, size, f"{words} ({len(points):,})")
    links = np.full((len(match.pairs), 3, 2), np.nan)  # the third of each breaks the line
    links[:, 0], links[:, 1] = moved[rows_p], q[rows_q]
    axes.plot(
        *links.reshape(-1, 2).T, color=hexadecimal(palette.PAIR_LINK), zorder=_LINK_ORDER,
        linewidth=max(size / 6, _LEAST_LINE), label=f"pair ({len(rows_p):,})",
        rasterized=len(rows_p) > _MOST_VECTORS,
    )  # fmt: skip
    _finish(axes, unit)
    figure.legend(loc="outside lower left", ncols=3, frameon=False, markerscale=_LEGEND_MARK / size)
    return figure


def _apart(p: Floats, q: Floats, names: tuple[str, str]) -> Figure:
    """Draw the sets side by side, each in a frame of its own."""
    figure = _figure(_WIDTH / 2 - _LEGEND, verdict(False), palette.NO_MATCH)
    size = _mark_size(_WIDTH / 2, 2 * max(len(p), len(q)))
    both = zip(figure.subplots(1, 2), (p, q), _APART, "PQ", names, strict=True)
    for axes, points, mark, letter, name in both:
        unit = _unit(points)
        _draw(axes, points / unit, mark, size, "")
        axes.set_title(f"{_title(letter, name)}: {len(points):,} points", fontsize="medium")
        _finish(axes, unit)
    return figure


def _figure(height: float, decision: str, colour: Colour) -> Figure:
    """Return a figure below the decision, its axes about `height` inches high, within limits."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    high = min(max(height, _LEAST_HEIGHT), _MOST_HEIGHT)
    figure = Figure(figsize=(_WIDTH + _SIDES, high + _AROUND), layout="constrained")
    style = {"fontsize": "x-large", "weight": "bold", "color": hexadecimal(colour)}
    figure.suptitle(decision, x=0.01, ha="left", **style)
    return figure


def _unit(*sets: Floats) -> float:
    """Return a power of ten in which matplotlib can draw the points, 1 for all but extreme ones."""
    largest = max(float(np.abs(points).max(initial=0.0)) for points in sets)
    exponent = math.floor(math.log10(largest)) if largest > 0 else 0
    return 10.0 ** max(exponent, _LEAST_EXPONENT) if abs(exponent) > _PLAIN_EXPONENT else 1.0


def _mark_size(height: float, count: int) -> float:
    """Return the size of marks, in points, at which `count` of them fit axes of a height."""
    side = 72 * min(_WIDTH, max(height, _LEAST_HEIGHT), _MOST_HEIGHT)
    return float(np.clip(_MARK_SHARE * side / np.sqrt(count), _LEAST_MARK, _MOST_MARK))


def _draw(axes: Axes, points: Floats, mark: _Mark, size: float, label: str) -> None:
    colour = hexadecimal(mark.colour)
    axes.plot(
        *points.T, mark.marker, markersize=mark.size * size, markeredgecolor=colour,
        markerfacecolor=colour if mark.filled else "none", zorder=mark.order, label=label,
        markeredgewidth=max(size / 8, _LEAST_LINE), rasterized=len(points) > _MOST_VECTORS,
    )  # fmt: skip


def _finish(axes: Axes, unit: float) -> None:
    axes.set_aspect("equal", anchor="NW")
    axes.set_axisbelow(True)
    axes.grid(color="0.92")
    words = "" if unit == 1.0 else f" ({unit:g})"
    axes.set(xlabel=f"x{words}", ylabel=f"y{words}")


def _title(letter: str, name: str) -> str:
    """Return a set's title; of a long path the end, which distinguishes it."""
    if name == letter:
        return letter
    clean = "".join(sign if sign.isprintable() else " " for sign in name)
    short = clean if len(clean) <= _NAME_LETTERS else "…" + clean[1 - _NAME_LETTERS :]
    return f"{letter} ({short})"

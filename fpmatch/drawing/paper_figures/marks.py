"""Points, lines, labels and tables of the figures.

P is blue with round points, Q orange with square ones, so that the shape distinguishes them too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import (
    PANEL_EDGE,
    PAPER,
    PROBE_INK,
    PROBE_MARK,
    REFERENCE_INK,
    REFERENCE_MARK,
    TEXT,
    TEXT_MUTED,
    Colour,
    hexadecimal,
)
from fpmatch.drawing.paper_figures.sheet import PX, label_width

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.delaunay.triangulation import Triangulation

    Floats = NDArray[np.float64]

MESH: Final[Colour] = (150, 154, 160)
PALE: Final = 0.22  # opacity of a shaded polygon
OUTLINE, SPOKE, EDGE = 2.2, 1.2, 1.3  # widths of lines
DOT, CENTRE_DOT, DOT_EDGE = 8.0, 10.0, 1.5  # size of a ring's points and centre, and their lines
STACKED_DOT: Final = {"P": 6.0, "Q": 10.0}  # where P is drawn over Q
BENEATH, MESHES, LINES, DOTS, ABOVE = 0.0, 1.0, 2.0, 4.0, 6.0  # layers
LABEL_SIZE: Final = 13.0
CAPITAL: Final = 0.73  # height of capitals, in the size
ROW_HEIGHT: Final = 28.0  # of a table


@dataclass(frozen=True, slots=True)
class Tint:
    """Hold the colours of a set's areas and marks, and the shape of its points."""

    ink: Colour
    mark: Colour
    shape: str


TINTS: Final = {
    "P": Tint(PROBE_INK, PROBE_MARK, "o"),
    "Q": Tint(REFERENCE_INK, REFERENCE_MARK, "s"),
}


def line(
    axes: Axes,
    points: ArrayLike,
    colour: Colour,
    width: float,
    *,
    dashed: bool = False,
    layer: float = LINES,
) -> None:
    """Draw a line through `points` (N, 2), `width` pixels wide."""
    axes.plot(
        *np.asarray(points, dtype=np.float64).T,
        color=hexadecimal(colour),
        linewidth=width * PX,
        linestyle=(0, (4, 3)) if dashed else "solid",
        solid_capstyle="round",
        solid_joinstyle="round",
        zorder=layer,
    )


def dots(
    axes: Axes,
    points: ArrayLike,
    tint: Tint,
    size: float = DOT,
    *,
    hollow: bool = False,
    layer: float = DOTS,
) -> None:
    """Draw points (N, 2), `size` pixels wide, in the shape of their set."""
    mark = hexadecimal(tint.mark)
    axes.plot(
        *np.asarray(points, dtype=np.float64).reshape(-1, 2).T,
        linestyle="none",
        marker=tint.shape,
        markersize=size * PX,
        markerfacecolor=hexadecimal(PAPER) if hollow else mark,
        markeredgecolor=mark,
        markeredgewidth=min(DOT_EDGE, size / 4) * PX,
        zorder=layer,
    )


def segments(axes: Axes, ends: Floats, colour: Colour, width: float) -> None:
    """Draw straight lines between pairs of points (N, 2, 2), beneath all other marks."""
    from matplotlib.collections import LineCollection  # noqa: PLC0415

    colours = hexadecimal(colour)
    lines = LineCollection(list(ends), colors=colours, linewidths=width * PX, zorder=MESHES)
    axes.add_collection(lines, autolim=False)


def mesh_lines(axes: Axes, mesh: Triangulation, colour: Colour = MESH) -> None:
    """Draw the edges of a triangulation."""
    segments(axes, mesh.points[mesh.edges], colour, EDGE)


def polygon(axes: Axes, corners: Floats, tint: Tint) -> None:
    """Draw a closed polygon with corners (N, 2), shaded."""
    axes.fill(*corners.T, facecolor=hexadecimal(tint.ink), alpha=PALE, edgecolor="none")
    line(axes, np.vstack([corners, corners[:1]]), tint.mark, OUTLINE)


def label(
    axes: Axes,
    at: ArrayLike,
    text: str,
    *,
    away: ArrayLike = (0.0, 0.0),
    distance: float = 0.0,
    size: float = LABEL_SIZE,
    colour: Colour = TEXT,
    bold: bool = False,
) -> None:
    """Write `text` on the point `at`, or beside it.

    It is moved off the point in the direction `away`, of any length, until `distance` pixels are
    between them; (0, 0) leaves its middle on the point. Mathematics is written between dollars.
    """
    x, y = np.asarray(at, dtype=np.float64).tolist()
    dx, dy = np.asarray(away, dtype=np.float64).tolist()
    length = math.hypot(dx, dy) or 1.0
    dx, dy = dx / length, dy / length
    half_width, half_height = label_width(text, size) / 2, CAPITAL * size / 2
    offset = (distance + abs(dx) * half_width + abs(dy) * half_height) * PX
    axes.annotate(
        text,
        (x, y),
        (dx * offset, dy * offset),
        textcoords="offset points",
        ha="center",
        va="center_baseline",
        fontsize=size * PX,
        fontweight="bold" if bold else "normal",
        color=hexadecimal(colour),
        annotation_clip=False,
        zorder=5,
    )


def table(
    axes: Axes, rows: Sequence[Sequence[str]], *, first: float = 0.6, sums: bool = True
) -> None:
    """Write `rows`, of which the first is the head and the last may be `sums`, into a panel.

    The first column is `first` times as wide as any other.
    """
    from matplotlib.transforms import Bbox  # noqa: PLC0415

    axes.set_axis_off()
    height = float(axes.bbox.height)
    step = min(ROW_HEIGHT, height / (len(rows) + 0.5))
    column = 1 / (len(rows[0]) - 1 + first)
    share = len(rows) * step / height
    made = axes.table(
        rows,
        colWidths=[first * column, *[column] * (len(rows[0]) - 1)],
        cellLoc="right",
        bbox=Bbox.from_bounds(0, 1 - share, 1, share),
        edges="open",
    )
    made.set_fontsize(min(LABEL_SIZE, 0.7 * step) * PX)  # shrinks where cells are too narrow
    for (row, place), cell in made.get_celld().items():
        cell.PAD = 0.05 if place else 0.0
        cell.get_text().set(ha="right" if place else "left")
        cell.get_text().set_color(hexadecimal(TEXT if row else TEXT_MUTED))
        cell.set(edgecolor=hexadecimal(PANEL_EDGE), linewidth=1.2 * PX)
        cell.visible_edges = "B" if row == 0 else "T" if sums and row == len(rows) - 1 else ""

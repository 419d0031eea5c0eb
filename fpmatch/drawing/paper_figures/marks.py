"""Marks that the pictures of point sets share: points, meshes and rings.

P is blue with round points, Q orange with square ones, so that shape tells them apart as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import (
    PAPER,
    PROBE_INK,
    PROBE_MARK,
    REFERENCE_INK,
    REFERENCE_MARK,
    Colour,
    hexadecimal,
)
from fpmatch.drawing.paper_figures.text import LABEL_SIZE, POINTS_PER_PX, label
from fpmatch.drawing.paper_figures.words import name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.drawing.paper_figures.ring import Ring
    from fpmatch.pointset.delaunay.triangulation import Triangulation

    Floats = NDArray[np.float64]

MESH: Final[Colour] = (150, 154, 160)
PALE: Final = 0.22  # opacity of a shaded polygon
LABEL_DISTANCE: Final = 9.0  # pixels from a point to its name
OUTLINE, SPOKE, EDGE = 2.2, 1.2, 1.3  # widths of lines, in pixels
DOT: Final = 8.0  # pixels across a point of a ring
CENTRE_DOT: Final = 10.0  # the same for its centre
DOT_EDGE: Final = 1.5
MESHES, LINES, DOTS, FRAMES = 1.0, 2.0, 4.0, 4.5  # later ones lie on earlier ones
STACKED_DOT: Final = {"P": 6.0, "Q": 10.0}  # the same where P lies on Q and shall fit into it
LONG_ENOUGH: Final = 0.4  # of a spoke beside which a name finds room, in the longest spoke
CROWDED: Final = 10  # points of a ring beyond which its labels shrink
LEAST_LABEL: Final = 8.0


@dataclass(frozen=True, slots=True)
class Tint:
    """Hold how a set is drawn: colour of its shades, colour and shape of its marks."""

    ink: Colour
    mark: Colour
    shape: str


TINTS: Final = {
    "P": Tint(PROBE_INK, PROBE_MARK, "o"),
    "Q": Tint(REFERENCE_INK, REFERENCE_MARK, "s"),
}


def label_size(ring: Ring) -> float:
    """Return the size of a ring's labels in pixels: smaller where it has many points."""
    return max(LEAST_LABEL, LABEL_SIZE * min(1.0, CROWDED / len(ring)))


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
    x, y = np.asarray(points, dtype=np.float64).T
    axes.plot(
        x,
        y,
        color=hexadecimal(colour),
        linewidth=width * POINTS_PER_PX,
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
    """Draw points (N, 2), `size` pixels across, in the shape of their set."""
    x, y = np.asarray(points, dtype=np.float64).reshape(-1, 2).T
    mark = hexadecimal(tint.mark)
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=tint.shape,
        markersize=size * POINTS_PER_PX,
        markerfacecolor=hexadecimal(PAPER) if hollow else mark,
        markeredgecolor=mark,
        markeredgewidth=min(DOT_EDGE, size / 4) * POINTS_PER_PX,
        zorder=layer,
    )


def mesh_lines(axes: Axes, mesh: Triangulation, colour: Colour = MESH) -> None:
    """Draw the edges of a triangulation."""
    segments(axes, mesh.points[mesh.edges], colour, EDGE)


def segments(axes: Axes, ends: Floats, colour: Colour, width: float) -> None:
    """Draw straight lines between pairs of points (N, 2, 2), beneath all else."""
    from matplotlib.collections import LineCollection  # noqa: PLC0415

    lines = LineCollection(
        list(ends), colors=hexadecimal(colour), linewidths=width * POINTS_PER_PX, zorder=MESHES
    )
    axes.add_collection(lines, autolim=False)


def ring_lines(axes: Axes, ring: Ring) -> None:
    """Draw a ring in the plane: shaded, with its sides, spokes, points and hollow centre."""
    tint = TINTS[ring.side.letter]
    polygon(axes, ring.points, tint)
    for point in ring.points:
        line(axes, [ring.middle, point], tint.mark, SPOKE)
    dots(axes, ring.points, tint)
    dots(axes, ring.middle, tint, CENTRE_DOT, hollow=True)


def polygon(axes: Axes, corners: Floats, tint: Tint) -> None:
    """Draw a closed polygon with corners (N, 2), shaded."""
    x, y = corners.T
    axes.fill(x, y, facecolor=hexadecimal(tint.ink), alpha=PALE, edgecolor="none")
    line(axes, np.vstack([corners, corners[:1]]), tint.mark, OUTLINE)


def ring_names(axes: Axes, ring: Ring, *, in_mesh: bool = False) -> None:
    """Write the names of a ring's points outside it, and its centre's.

    `in_mesh` says that the triangulation is drawn as well: names keep clear of its edges.
    """
    tint, letter = TINTS[ring.side.letter], ring.side.letter
    middle = ring.points.mean(axis=0)
    for k, point in enumerate(ring.points):
        away = point - middle
        if in_mesh:
            mesh = ring.side.mesh
            away = roomiest(mesh.points[mesh.one_ring(ring.vertex[k])] - point, away)
        label(
            axes,
            point,
            name(letter, k),
            away=away,
            distance=LABEL_DISTANCE,
            size=label_size(ring),
        )
    label(
        axes,
        ring.middle,
        letter.lower(),
        away=roomiest(ring.points - ring.middle),
        distance=LABEL_DISTANCE,
        colour=tint.mark,
        bold=True,
    )


def roomiest(spokes: Floats, towards: Floats | None = None) -> Floats:
    """Return the direction (2,) between two neighbouring `spokes` (d, 2) that has the most room.

    Room is a wide gap, and spokes beside it that are not too short. Where `towards` (2,) is given,
    the direction lies less than a right angle from it, if there is a gap so.

    Examples
    --------
    >>> roomiest(np.array([[0.0, -1.0], [0.0, 1.0], [-1.0, 0.0]])).tolist()
    [1.0, 0.0]
    """
    angles = np.arctan2(spokes[:, 1], spokes[:, 0])
    order = angles.argsort()
    angles, length = angles[order], np.hypot(*spokes[order].T)
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    beside = np.minimum(length, np.roll(length, -1))
    middles = angles + gaps / 2
    ways = np.column_stack([np.cos(middles), np.sin(middles)])
    room = gaps * np.minimum(beside, LONG_ENOUGH * length.max())
    if towards is not None:
        room = np.where(ways @ towards > 0, room, 0.0)
    return np.asarray(ways[room.argmax()])

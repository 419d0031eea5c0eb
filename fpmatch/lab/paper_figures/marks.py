"""Points, lines, labels, tables and one-rings of the figures.

P is blue with round points, Q orange with square ones, so that the shape distinguishes them too.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.palette import Colour, hexadecimal
from fpmatch.lab.paper_figures.sheet import PX, label_width, show

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.paper_figures.rings import Ring
    from fpmatch.pointset.delaunay.triangulate import Triangulation

    Floats = NDArray[np.float64]

MESH: Final[Colour] = (150, 154, 160)
PALE: Final = 0.22  # opacity of a shaded polygon
OUTLINE, SPOKE, EDGE = 2.2, 1.2, 1.3  # widths of lines
DOT, CENTRE_DOT, DOT_EDGE = 8.0, 10.0, 1.5  # size of a ring's points and centre, and their lines
STACKED_DOT: Final = {"P": 6.0, "Q": 10.0}  # where P is drawn over Q
BENEATH, MESHES, LINES, LABELS, DOTS = 0.0, 1.0, 2.0, 3.5, 4.0  # layers
LABEL_SIZE: Final = 13.0
CAPITAL: Final = 0.73  # height of capitals, in the size
LABEL_DISTANCE: Final = 9.0  # pixels from a point to its name
CIRCLE_ROOM: Final = 44.0  # pixels around a circle
LONG_ENOUGH: Final = 0.4  # of a spoke beside which a name has room, in the longest spoke
CROWDED: Final = 10  # points of a ring beyond which its labels shrink
LEAST_LABEL: Final = 8.0
ROW_HEIGHT: Final = 28.0  # of a table


class Tint(NamedTuple):
    """The colours of a set's areas and marks, and the shape of its points."""

    ink: Colour
    mark: Colour
    shape: str


TINTS: Final = {
    "P": Tint(palette.PROBE_INK, palette.PROBE_MARK, "o"),
    "Q": Tint(palette.REFERENCE_INK, palette.REFERENCE_MARK, "s"),
}


def line(axes: Axes, points: ArrayLike, colour: Colour, width: float, style: str = "-") -> None:
    """Draw a line through `points` (N, 2), `width` pixels wide."""
    x, y = np.asarray(points, dtype=np.float64).T
    axes.plot(x, y, style, color=hexadecimal(colour), linewidth=width * PX, zorder=LINES)


def dots(
    axes: Axes, points: ArrayLike, tint: Tint, size: float = DOT, *, hollow: bool = False
) -> None:
    """Draw points (N, 2), `size` pixels wide, in the shape of their set."""
    x, y = np.asarray(points, dtype=np.float64).reshape(-1, 2).T
    edge = hexadecimal(tint.mark)
    face = hexadecimal(palette.PAPER) if hollow else edge
    axes.plot(
        x, y, tint.shape, markersize=size * PX, markerfacecolor=face, markeredgecolor=edge,
        markeredgewidth=min(DOT_EDGE, size / 4) * PX, zorder=DOTS,
    )  # fmt: skip


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
    line(axes, closed(corners), tint.mark, OUTLINE)


def closed(corners: Floats) -> Floats:
    """Return corners (N, 2) with the first repeated at the end."""
    return np.vstack([corners, corners[:1]])


def label(
    axes: Axes,
    at: ArrayLike,
    text: str,
    *,
    away: ArrayLike = (0.0, 0.0),
    distance: float = LABEL_DISTANCE,
    size: float = LABEL_SIZE,
    colour: Colour = palette.TEXT,
    bold: bool = False,
) -> None:
    """Write `text` on the point `at`, or beside it; mathematics is written between dollars.

    It is moved off the point in the direction `away`, of any length, until `distance` pixels are
    between them; (0, 0) leaves its middle on the point.
    """
    dx, dy = np.asarray(away, dtype=np.float64).tolist()
    length = math.hypot(dx, dy) or 1.0
    dx, dy = dx / length, dy / length
    half_width, half_height = label_width(text, size) / 2, CAPITAL * size / 2
    offset = (distance + abs(dx) * half_width + abs(dy) * half_height) * PX
    x, y = np.asarray(at, dtype=np.float64).tolist()
    axes.annotate(
        text, (x, y), (dx * offset, dy * offset), textcoords="offset points", ha="center",
        va="center_baseline", fontsize=size * PX, fontweight="bold" if bold else "normal",
        color=hexadecimal(colour), annotation_clip=False, zorder=LABELS,
    )  # fmt: skip


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
    others, share = len(rows[0]) - 1, len(rows) * step / height
    made = axes.table(
        rows, colWidths=[first / (others + first), *[1 / (others + first)] * others],
        bbox=Bbox.from_bounds(0, 1 - share, 1, share), edges="open",
    )  # fmt: skip
    made.set_fontsize(min(LABEL_SIZE, 0.7 * step) * PX)  # shrinks where cells are too narrow
    for (row, place), cell in made.get_celld().items():
        cell.PAD = 0.05 if place else 0.0
        colour = hexadecimal(palette.TEXT if row else palette.TEXT_MUTED)
        cell.get_text().set(ha="right" if place else "left", color=colour)
        cell.set(edgecolor=hexadecimal(palette.PANEL_EDGE), linewidth=1.2 * PX)
        cell.visible_edges = "B" if row == 0 else "T" if sums and row == len(rows) - 1 else ""


# One-rings in the plane and on the unit circle, with the names of their points


def label_size(ring: Ring) -> float:
    """Return the size of a ring's labels in pixels: smaller where it has many points."""
    return max(LEAST_LABEL, LABEL_SIZE * min(1.0, CROWDED / len(ring)))


def spokes(axes: Axes, tint: Tint, boundary: Floats, centre: Floats) -> None:
    """Draw the polygon of points (d, 2), shaded, its spokes, and the centre (2,), hollow."""
    polygon(axes, boundary, tint)
    for point in boundary:
        line(axes, [centre, point], tint.mark, SPOKE)
    dots(axes, boundary, tint)
    dots(axes, centre, tint, CENTRE_DOT, hollow=True)


def plane_ring(axes: Axes, ring: Ring, room: float) -> None:
    """Draw a ring in a panel, `room` pixels around it."""
    show(axes, ring.points, room)
    spokes(axes, TINTS[ring.side.letter], ring.points, ring.middle)


def ring_in_mesh(axes: Axes, ring: Ring, room: float, colour: Colour = MESH) -> None:
    """Draw a ring with its names, `room` pixels around it, in the triangulation of its set."""
    plane_ring(axes, ring, room)
    mesh_lines(axes, ring.side.mesh, colour)
    ring_names(axes, ring, in_mesh=True)


def ring_names(axes: Axes, ring: Ring, *, in_mesh: bool = False) -> None:
    """Write the names of a ring's points outside it, and its centre's.

    With `in_mesh`, names avoid the edges of the triangulation.
    """
    mesh = ring.side.mesh
    for name, point, vertex in zip(ring.names, ring.points, ring.vertex, strict=True):
        away = point - ring.points.mean(axis=0)
        if in_mesh:
            away = roomiest(mesh.points[mesh.one_ring(vertex)] - point, away)
        label(axes, point, name, away=away, size=label_size(ring))
    letter, away = ring.side.letter, roomiest(ring.points - ring.middle)
    label(axes, ring.middle, letter.lower(), away=away, colour=TINTS[letter].mark, bold=True)


def roomiest(spokes: Floats, towards: Floats | None = None) -> Floats:
    """Return the direction (2,) between two neighbouring `spokes` (d, 2) that has the most room.

    Room is a wide gap between spokes that are not too short. Where `towards` (2,) is given, the
    direction is less than a right angle from it, if such a gap exists.
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


def unit_circle_frame(axes: Axes) -> None:
    """Fit the unit circle into a panel, and draw it."""
    from matplotlib.patches import Circle  # noqa: PLC0415

    show(axes, [(-1.0, -1.0), (1.0, 1.0)], CIRCLE_ROOM)
    face, edge = hexadecimal(palette.BAND), hexadecimal(palette.NEUTRAL_INK)
    circle = Circle((0, 0), 1, facecolor=face, edgecolor=edge, linewidth=1.5 * PX, zorder=0.5)
    axes.add_patch(circle)


def circle_names(axes: Axes, boundary: Floats, texts: list[str], size: float) -> None:
    """Write names outside the unit circle, beside its points (d, 2)."""
    for at, text in zip(boundary, texts, strict=True):
        label(axes, at, text, away=at, size=size)


def circle_ring(axes: Axes, ring: Ring, angle: float = 0.0, avoid: Sequence[Floats] = ()) -> None:
    """Draw a ring on the unit circle, rotated by `angle` radians, and its centre's image.

    The image's name avoids lines to the points of the ring, or those to `avoid`, (2,) each.
    """
    letter, tint = ring.side.letter, TINTS[ring.side.letter]
    boundary, image = (rotated(xy, angle) for xy in (ring.circle.boundary, ring.circle.image))
    unit_circle_frame(axes)
    spokes(axes, tint, boundary, image)
    circle_names(axes, boundary, ring.names, label_size(ring))
    name, away = f"$c_{letter.lower()}$", roomiest(np.vstack([boundary, *avoid]) - image)
    distance, size = LABEL_DISTANCE + 2, LABEL_SIZE + 2
    label(axes, image, name, away=away, distance=distance, size=size, colour=tint.mark)


def rotated(points: Floats, angle: float) -> Floats:
    """Return `points` (..., 2) rotated by `angle` radians about the origin."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))

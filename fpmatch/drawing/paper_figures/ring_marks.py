"""One-rings in the plane and on the unit circle, with the names of their points."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import BAND, NEUTRAL_INK, hexadecimal
from fpmatch.drawing.paper_figures.marks import (
    CENTRE_DOT,
    LABEL_SIZE,
    SPOKE,
    TINTS,
    dots,
    label,
    line,
    mesh_lines,
    polygon,
)
from fpmatch.drawing.paper_figures.sheet import PX, show

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.palette import Colour
    from fpmatch.drawing.paper_figures.rings import Ring

    Floats = NDArray[np.float64]

CIRCLE_ROOM: Final = 44.0  # pixels around a circle
LABEL_DISTANCE: Final = 9.0  # pixels from a point to its name
LONG_ENOUGH: Final = 0.4  # of a spoke beside which a name has room, in the longest spoke
CROWDED: Final = 10  # points of a ring beyond which its labels shrink
LEAST_LABEL: Final = 8.0


def label_size(ring: Ring) -> float:
    """Return the size of a ring's labels in pixels: smaller where it has many points."""
    return max(LEAST_LABEL, LABEL_SIZE * min(1.0, CROWDED / len(ring)))


def spokes(axes: Axes, letter: str, boundary: Floats, centre: Floats) -> None:
    """Draw the polygon of a set's points (d, 2), shaded, and its spokes from the centre."""
    polygon(axes, boundary, TINTS[letter])
    for point in boundary:
        line(axes, [centre, point], TINTS[letter].mark, SPOKE)
    dots(axes, boundary, TINTS[letter])


def plane_ring(axes: Axes, ring: Ring) -> None:
    """Draw a ring in the plane: shaded, with its sides, spokes, points and hollow centre."""
    spokes(axes, ring.side.letter, ring.points, ring.middle)
    dots(axes, ring.middle, TINTS[ring.side.letter], CENTRE_DOT, hollow=True)


def ring_in_mesh(axes: Axes, ring: Ring, room: float, colour: Colour) -> None:
    """Draw a ring with its names, `room` pixels around it, in the triangulation of its set."""
    show(axes, ring.points, room)
    mesh_lines(axes, ring.side.mesh, colour)
    plane_ring(axes, ring)
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
        label(axes, point, name, away=away, distance=LABEL_DISTANCE, size=label_size(ring))
    label(
        axes,
        ring.middle,
        ring.side.letter.lower(),
        away=roomiest(ring.points - ring.middle),
        distance=LABEL_DISTANCE,
        colour=TINTS[ring.side.letter].mark,
        bold=True,
    )


def roomiest(spokes: Floats, towards: Floats | None = None) -> Floats:
    """Return the direction (2,) between two neighbouring `spokes` (d, 2) that has the most room.

    Room is a wide gap between spokes that are not too short. Where `towards` (2,) is given, the
    direction is less than a right angle from it, if such a gap exists.

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


def unit_circle_frame(axes: Axes) -> None:
    """Fit the unit circle into a panel, and draw it."""
    from matplotlib.patches import Circle  # noqa: PLC0415

    show(axes, [(-1.0, -1.0), (1.0, 1.0)], CIRCLE_ROOM)
    face, edge = hexadecimal(BAND), hexadecimal(NEUTRAL_INK)
    circle = Circle((0, 0), 1, facecolor=face, edgecolor=edge, linewidth=1.5 * PX, zorder=0.5)
    axes.add_patch(circle)


def circle_names(axes: Axes, boundary: Floats, texts: list[str], size: float) -> None:
    """Write names outside the unit circle, beside its points (d, 2)."""
    for at, text in zip(boundary, texts, strict=True):
        label(axes, at, text, away=at, distance=LABEL_DISTANCE, size=size)


def circle_ring(axes: Axes, ring: Ring, angle: float = 0.0, avoid: Sequence[Floats] = ()) -> None:
    """Draw a ring on the unit circle, rotated by `angle` radians, and its centre's image.

    The image's name avoids lines to the points of the ring, or those to `avoid`, (2,) each.
    """
    letter = ring.side.letter
    boundary, image = (rotated(xy, angle) for xy in (ring.circle.boundary, ring.circle.image))
    unit_circle_frame(axes)
    spokes(axes, letter, boundary, image)
    circle_names(axes, boundary, ring.names, label_size(ring))
    dots(axes, image, TINTS[letter], CENTRE_DOT, hollow=True)
    label(
        axes,
        image,
        f"$c_{letter.lower()}$",
        away=roomiest(np.vstack([boundary, *avoid]) - image),
        distance=LABEL_DISTANCE + 2,
        size=LABEL_SIZE + 2,
        colour=TINTS[letter].mark,
    )


def rotated(points: Floats, angle: float) -> Floats:
    """Return `points` (..., 2) rotated by `angle` radians about the origin.

    Examples
    --------
    >>> rotated(np.array([1.0, 0.0]), math.pi / 2).round(9).tolist()
    [0.0, 1.0]
    """
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))

"""Unit circles as the pictures draw them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import BAND, NEUTRAL_INK, hexadecimal
from fpmatch.drawing.paper_figures.marks import (
    CENTRE_DOT,
    LABEL_DISTANCE,
    SPOKE,
    TINTS,
    dots,
    line,
    polygon,
    roomiest,
)
from fpmatch.drawing.paper_figures.sheet import show
from fpmatch.drawing.paper_figures.text import LABEL_SIZE, POINTS_PER_PX, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

CIRCLE_ROOM: Final = 44.0  # pixels around a circle


def show_circle(axes: Axes) -> None:
    """Fit the unit circle into a panel, and draw it."""
    from matplotlib.patches import Circle  # noqa: PLC0415

    show(axes, [(-1.0, -1.0), (1.0, 1.0)], CIRCLE_ROOM)
    axes.add_patch(
        Circle(
            (0.0, 0.0),
            1.0,
            facecolor=hexadecimal(BAND),
            edgecolor=hexadecimal(NEUTRAL_INK),
            linewidth=1.5 * POINTS_PER_PX,
            zorder=0.5,
        )
    )


def circle_names(axes: Axes, boundary: Floats, texts: list[str], size: float) -> None:
    """Write names outside the unit circle, beside its points (d, 2)."""
    for at, text in zip(boundary, texts, strict=True):
        label(axes, at, text, away=at, distance=LABEL_DISTANCE, size=size)


def spoked(axes: Axes, letter: str, boundary: Floats, centre: Floats) -> None:
    """Draw the polygon of a set's boundary points (d, 2), shaded, and its spokes."""
    polygon(axes, boundary, TINTS[letter])
    for point in boundary:
        line(axes, [centre, point], TINTS[letter].mark, SPOKE)
    dots(axes, boundary, TINTS[letter])


def image(axes: Axes, at: Floats, letter: str, lines_to: Floats) -> None:
    """Draw a centre's image, and write c_p or c_q where the lines to points (N, 2) leave room."""
    dots(axes, at, TINTS[letter], CENTRE_DOT, hollow=True)
    label(
        axes,
        at,
        f"$c_{letter.lower()}$",
        away=roomiest(lines_to - at),
        distance=LABEL_DISTANCE + 2,
        size=LABEL_SIZE + 2,
        colour=TINTS[letter].mark,
    )


def turned(points: Floats, angle: float) -> Floats:
    """Return `points` (..., 2) turned by `angle` radians about the middle of the circle.

    Examples
    --------
    >>> turned(np.array([1.0, 0.0]), math.pi / 2).round(9).tolist()
    [0.0, 1.0]
    """
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))

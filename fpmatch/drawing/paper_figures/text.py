"""Labels in the pictures of point sets, and how wide texts are."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import TEXT, Colour, hexadecimal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

FONT: Final = "DejaVu Sans"  # the one that comes inside matplotlib
CAPITAL: Final = 0.73  # height of its capitals, in the size
FULL_LINE: Final = 0.98  # of a line's room: fonts are not alike to the pixel everywhere
LABEL_SIZE: Final = 13.0
PX_PER_INCH: Final = 96
POINTS_PER_PX: Final = 72 / PX_PER_INCH  # fonts and lines are measured in points


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
    """Write `text` on a point, or beside it.

    Parameters
    ----------
    axes : Axes
        The panel.
    at, away : array_like of float, shape (2,)
        A point, and the direction, of any length, in which the text is moved off it; (0, 0)
        leaves its middle on the point.
    text : str
        A short text, mathematics between dollars; a white rim keeps it apart from what lies
        beneath.
    distance : float
        Pixels between the point and the text.
    size : float
        Height of the font in pixels.
    colour : Colour
        Of the letters.
    bold : bool
        Whether the letters are bold.
    """
    x, y = np.asarray(at, dtype=np.float64).tolist()
    dx, dy = np.asarray(away, dtype=np.float64).tolist()
    length = math.hypot(dx, dy) or 1.0
    dx, dy = dx / length, dy / length
    half_width, half_height = text_width(text, size) / 2, CAPITAL * size / 2
    offset = (distance + abs(dx) * half_width + abs(dy) * half_height) * POINTS_PER_PX
    axes.annotate(
        text,
        (x, y),
        (dx * offset, dy * offset),
        textcoords="offset points",
        ha="center",
        va="center_baseline",
        fontsize=size * POINTS_PER_PX,
        fontweight="bold" if bold else "normal",
        color=hexadecimal(colour),
        annotation_clip=False,
        zorder=5,
    )


def text_width(text: str, size: float) -> float:
    """Return the width of `text` in pixels at `size`, in the font of the pictures."""
    from matplotlib.font_manager import FontProperties  # noqa: PLC0415
    from matplotlib.textpath import text_to_path  # noqa: PLC0415

    font = FontProperties(family=FONT, size=size)
    return float(text_to_path.get_text_width_height_descent(text, font, "$" in text)[0])


def wrapped(text: str, size: float, width: float) -> list[str]:
    """Break `text` between words into lines no wider than `width` pixels in matplotlib's font."""
    lines: list[str] = []
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size) <= FULL_LINE * width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines

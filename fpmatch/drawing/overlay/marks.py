"""Minutiae as marks: a shape for the kind, a tick for the direction, weight for what is paired."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.palette import PAIR_LINK, PROBE_MARK, REFERENCE_MARK, Colour
from fpmatch.drawing.scene.items import Circle, Path, Pen
from fpmatch.drawing.scene.placement import direction_on_page, moved
from fpmatch.minutiae import MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Box, Point
    from fpmatch.minutiae import Minutiae

_SQUARE_SHARE: Final = math.sqrt(math.pi) / 2  # half the side of a square as large as the circle
_KIND_NAMES: Final = {
    MinutiaKind.ENDING: "ending",
    MinutiaKind.BIFURCATION: "bifurcation",
    MinutiaKind.OTHER: "minutia",
}


@dataclass(frozen=True, slots=True)
class MarkStyle:
    """Hold how the minutiae of one side are drawn; lengths in page pixels.

    Parameters
    ----------
    colour : Colour
        Of the shape's outline and of the tick.
    radius : float
        Radius of an ending's circle; squares and diamonds are of about the same area.
    tick_px : float
        Length of the tick beyond the shape.
    width : float
        Width of the lines.
    halo : float
        Width of the white around them.
    opacity : float
        0 to 1.
    filled : bool
        Whether the shape is filled with its colour, rather than with paper.
    role : str
        SVG class.
    """

    colour: Colour
    radius: float
    tick_px: float
    width: float
    halo: float
    opacity: float
    filled: bool
    role: str

    @property
    def pen(self) -> Pen:
        """The pen that draws the shape."""
        fill = self.colour if self.filled else None
        return Pen(self.colour, fill, self.width, self.opacity, self.halo)


REFERENCE_PAIRED: Final = MarkStyle(
    REFERENCE_MARK,
    radius=7.5,
    tick_px=11.0,
    width=2.2,
    halo=1.4,
    opacity=1.0,
    filled=False,
    role="reference paired",
)
PROBE_PAIRED: Final = MarkStyle(
    PROBE_MARK,
    radius=3.2,
    tick_px=12.0,
    width=2.0,
    halo=1.2,
    opacity=1.0,
    filled=True,
    role="probe paired",
)
REFERENCE_UNPAIRED: Final = replace(
    REFERENCE_PAIRED,
    radius=5.0,
    tick_px=8.0,
    width=1.3,
    halo=1.0,
    opacity=0.8,
    role="reference unpaired",
)
PROBE_UNPAIRED: Final = replace(
    PROBE_PAIRED,
    radius=3.0,
    tick_px=8.0,
    width=1.3,
    halo=1.0,
    opacity=0.8,
    role="probe unpaired",
)
PAIR_PEN: Final = Pen(PAIR_LINK, width=2.0, halo=1.2)


def mark(
    point: Point, direction: Point, kind: int, style: MarkStyle, title: str = ""
) -> tuple[Path | Circle, ...]:
    """Draw one minutia: its tick, then its shape.

    Parameters
    ----------
    point : Point
        Its place on the page.
    direction : Point
        Unit vector of its direction on the page.
    kind : int
        0 other (a diamond), 1 ending (a circle), 2 bifurcation (a square).
    style : MarkStyle
        How to draw it.
    title : str
        What a viewer shows on hovering.

    Returns
    -------
    tuple of Path and Circle
        The items to draw, in order.
    """
    (x, y), (dx, dy) = point, direction
    reach = style.radius + style.tick_px
    tick_pen = replace(style.pen, fill=None)
    tick = Path(
        ((x + style.radius * dx, y + style.radius * dy), (x + reach * dx, y + reach * dy)),
        tick_pen,
        role=f"tick {style.role}",
    )
    if kind == MinutiaKind.ENDING:
        return tick, Circle(point, style.radius, style.pen, f"ending {style.role}", title)
    if kind == MinutiaKind.BIFURCATION:
        h = style.radius * _SQUARE_SHARE
        square = ((x - h, y - h), (x + h, y - h), (x + h, y + h), (x - h, y + h))
        return tick, Path(square, style.pen, True, f"bifurcation {style.role}", title)
    h = style.radius * _SQUARE_SHARE * math.sqrt(2)
    diamond = ((x, y - h), (x + h, y), (x, y + h), (x - h, y))
    return tick, Path(diamond, style.pen, True, f"other {style.role}", title)


def marks(
    minutiae: Minutiae,
    index: Iterable[int],
    matrix: NDArray[np.float64],
    style: MarkStyle,
    panel: Box,
    titles: dict[int, str] | None = None,
) -> list[Path | Circle]:
    """Draw the minutiae that `index` names and whose place, under `matrix`, lies in `panel`."""
    points = moved(matrix, minutiae.xy)
    drawn: list[Path | Circle] = []
    for i in index:
        if panel.holds(points[i]):
            direction = direction_on_page(matrix, float(minutiae.angle[i]))
            title = (titles or {}).get(i, described(minutiae, i))
            drawn += mark(points[i], direction, int(minutiae.kind[i]), style, title)
    return drawn


def described(minutiae: Minutiae, i: int) -> str:
    """Put a minutia in words.

    Examples
    --------
    >>> from fpmatch.minutiae import Minutiae
    >>> described(Minutiae([3.0], [4.0], [0.0], [1]), 0)
    'ending at (3, 4), direction 0°, quality 100'
    """
    kind = _KIND_NAMES[MinutiaKind(int(minutiae.kind[i]))]
    degrees = math.degrees(float(minutiae.angle[i]))
    return (
        f"{kind} at ({minutiae.x[i]:.0f}, {minutiae.y[i]:.0f}), "
        f"direction {degrees:.0f}°, quality {minutiae.quality[i]}"
    )

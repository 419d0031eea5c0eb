"""Minutiae as marks: the shape shows the kind, a tick the direction, the weight the pairing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.palette import PAIR_LINK, PROBE_MARK, REFERENCE_MARK, Colour
from fpmatch.drawing.scene.items import Box, Circle, Path, Pen
from fpmatch.drawing.scene.placement import direction_on_page, moved
from fpmatch.minutiae import MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Point
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
        Colour of the shape's outline and of the tick.
    radius : float
        Radius of an ending's circle; squares and diamonds have about the same area.
    tick_px : float
        Length of the tick beyond the shape.
    width, halo : float
        Width of the lines, and of the white around them.
    opacity : float
        0 to 1.
    filled : bool
        Whether the shape is filled with its colour.
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
    REFERENCE_MARK, 7.5, 11.0, 2.2, 1.4, 1.0, filled=False, role="reference paired"
)
REFERENCE_UNPAIRED: Final = MarkStyle(
    REFERENCE_MARK, 5.0, 8.0, 1.3, 1.0, 0.8, filled=False, role="reference unpaired"
)
PROBE_PAIRED: Final = MarkStyle(
    PROBE_MARK, 3.2, 12.0, 2.0, 1.2, 1.0, filled=True, role="probe paired"
)
PROBE_UNPAIRED: Final = MarkStyle(
    PROBE_MARK, 3.0, 8.0, 1.3, 1.0, 0.8, filled=True, role="probe unpaired"
)
BESIDE_REFERENCE_PAIRED: Final = replace(REFERENCE_PAIRED, radius=6.0, tick_px=10.0)
BESIDE_REFERENCE_UNPAIRED: Final = replace(REFERENCE_UNPAIRED, radius=4.5)
BESIDE_PROBE_PAIRED: Final = replace(
    BESIDE_REFERENCE_PAIRED, colour=PROBE_MARK, role="probe paired"
)
BESIDE_PROBE_UNPAIRED: Final = replace(
    BESIDE_REFERENCE_UNPAIRED, colour=PROBE_MARK, role="probe unpaired"
)
PAIR_PEN: Final = Pen(PAIR_LINK, width=2.0, halo=1.2)
PROBE_EDGE: Final = Pen(PROBE_MARK, width=1.6, opacity=0.85, dash=(9.0, 6.0))
REFERENCE_EDGE: Final = Pen(REFERENCE_MARK, width=1.6, opacity=0.85, dash=(2.0, 5.0))


def mark(
    point: Point, direction: Point, kind: int, style: MarkStyle, title: str = ""
) -> tuple[Path, Path | Circle]:
    """Draw one minutia on the page: its tick, then its shape.

    The shape is a circle for an ending, a square for a bifurcation, a diamond for any other kind;
    `direction` is a unit vector.
    """
    (x, y), (dx, dy) = point, direction
    r, end = style.radius, style.radius + style.tick_px
    line = ((x + r * dx, y + r * dy), (x + end * dx, y + end * dy))
    tick = Path(line, replace(style.pen, fill=None), role=f"tick {style.role}")
    if kind == MinutiaKind.ENDING:
        return tick, Circle(point, r, style.pen, f"ending {style.role}", title)
    half = r * _SQUARE_SHARE
    if kind == MinutiaKind.BIFURCATION:
        square = Box(x, y, 0, 0).grown(half).corners
        return tick, Path(square, style.pen, True, f"bifurcation {style.role}", title)
    half *= math.sqrt(2)
    diamond = ((x, y - half), (x + half, y), (x, y + half), (x - half, y))
    return tick, Path(diamond, style.pen, True, f"other {style.role}", title)


def marks(
    minutiae: Minutiae,
    index: Iterable[int],
    matrix: NDArray[np.float64],
    style: MarkStyle,
    panel: Box,
    titles: dict[int, str] | None = None,
) -> list[Path | Circle]:
    """Draw the minutiae at `index` whose place, under `matrix`, is in `panel`."""
    points = moved(matrix, minutiae.xy)
    drawn: list[Path | Circle] = []
    for i in index:
        if panel.contains(points[i]):
            direction = direction_on_page(matrix, float(minutiae.angle[i]))
            title = (titles or {}).get(i, described(minutiae, i))
            drawn += mark(points[i], direction, int(minutiae.kind[i]), style, title)
    return drawn


def unpaired(minutiae: Minutiae, paired: Iterable[int]) -> list[int]:
    """Return the indices of all minutiae but the paired ones."""
    return sorted(set(range(len(minutiae))) - set(paired))


def described(minutiae: Minutiae, i: int) -> str:
    """Return kind, place, direction and quality of a minutia as text.

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

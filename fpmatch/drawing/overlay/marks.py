"""Minutiae as marks: the shape shows the kind, a tick the direction, the weight the pairing.

Marks that an examiner set are crosses in circles, each with its letter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.items import Box, Circle, Path, Pen, Text, direction_on_page, moved
from fpmatch.drawing.scene.palette import (
    EXAMINER_MARK,
    PAIR_LINK,
    PROBE_FAINT,
    PROBE_MARK,
    REFERENCE_FAINT,
    REFERENCE_MARK,
    Colour,
)
from fpmatch.templates.minutiae import MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Anchor, Item, Point
    from fpmatch.templates.minutiae import Minutiae

_SQUARE_SHARE: Final = math.sqrt(math.pi) / 2  # half the side of a square as large as the circle
_KIND_NAMES: Final = ("minutia", "ending", "bifurcation")  # by the values of MinutiaKind


@dataclass(frozen=True, slots=True)
class MarkStyle:
    """The style of the minutiae of one side; lengths in page pixels."""

    colour: Colour  # of the shape's outline and of the tick
    radius: float  # of an ending's circle; squares and diamonds have about the same area
    tick_px: float  # beyond the shape
    width: float  # of the lines
    halo: float  # of white around them
    role: str  # the SVG class

    @property
    def pen(self) -> Pen:
        """The pen that draws the shape."""
        return Pen(self.colour, width=self.width, halo=self.halo)


PAIRED: Final = {
    "reference": MarkStyle(REFERENCE_MARK, 7.5, 11.0, 2.2, 1.4, "reference paired"),
    "probe": MarkStyle(PROBE_MARK, 4.0, 12.0, 2.2, 0.8, "probe paired"),
}
UNPAIRED: Final = {
    "reference": MarkStyle(REFERENCE_FAINT, 5.0, 8.0, 1.3, 1.0, "reference unpaired"),
    "probe": MarkStyle(PROBE_FAINT, 3.4, 8.0, 1.3, 1.0, "probe unpaired"),
}
PAIR_PEN: Final = Pen(PAIR_LINK, width=2.0, halo=1.2)
EDGES: Final = {
    "reference": Pen(REFERENCE_FAINT, width=1.6, dash=(2.0, 5.0)),
    "probe": Pen(PROBE_FAINT, width=1.6, dash=(9.0, 6.0)),
}
BESIDE_PAIRED: Final = {
    role: replace(style, radius=6.0, tick_px=10.0, width=2.2, halo=1.4)
    for role, style in PAIRED.items()
}
BESIDE_UNPAIRED: Final = {role: replace(style, radius=4.5) for role, style in UNPAIRED.items()}
_EXAMINER_PEN: Final = Pen(EXAMINER_MARK, width=2.2, halo=1.4)
_EXAMINER_RADIUS, _LETTER_SIZE = 11.0, 22.0
_ARCS: Final = 6  # of a dashed circle
_ARC_ANGLES: Final = (-0.3, -0.1, 0.1, 0.3)  # radians, of the points of an arc about its middle


@dataclass(frozen=True, slots=True)
class ExaminerMark:
    """A mark that an examiner set: its letter, and its place on one side, in pixels."""

    letter: str
    side: str
    x: float
    y: float


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
    tick = Path(line, style.pen, role=f"tick {style.role}")
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


def examiner_marks(
    own: Iterable[ExaminerMark],
    side: str,
    here: NDArray[np.float64],
    there: NDArray[np.float64] | None,
    panel: Box,
) -> list[Item]:
    """Draw the marks of an examiner on the print of a `side`, whose pixels `here` maps to the page.

    Those of the other side are drawn where `there` maps them, dashed and without the cross.
    """
    drawn: list[Item] = []
    for mark_ in own:
        matrix = here if mark_.side == side else there
        if matrix is not None:
            (point,) = moved(matrix, [(mark_.x, mark_.y)])
            if panel.contains(point):
                drawn += _examiner_mark(point, mark_.letter, panel, dashed=mark_.side != side)
    return drawn


def _examiner_mark(point: Point, letter: str, panel: Box, *, dashed: bool) -> list[Item]:
    (x, y), r = point, _EXAMINER_RADIUS
    if dashed:
        middles = (2 * math.pi * k / _ARCS for k in range(_ARCS))
        angles = [[middle + angle for angle in _ARC_ANGLES] for middle in middles]
        lines = [tuple((x + r * math.cos(a), y + r * math.sin(a)) for a in arc) for arc in angles]
    else:
        lines = [((x - r, y), (x + r, y)), ((x, y - r), (x, y + r))]
    title = f"mark {letter}"
    circle = () if dashed else (Circle(point, r, _EXAMINER_PEN, "examiner", title),)
    left = x + r + 2 + text_width(letter, _LETTER_SIZE) > panel.right
    below = y - r - _LETTER_SIZE < panel.y
    baseline = y + r + 0.7 * _LETTER_SIZE if below else y - r + 4
    anchor: Anchor = "end" if left else "start"
    start = x - r - 2 if left else x + r + 2
    return [
        *circle,
        *(Path(line, _EXAMINER_PEN, role="examiner", title=title) for line in lines),
        Text(start, baseline, letter, _LETTER_SIZE, EXAMINER_MARK, anchor, 0.8, 2.5, "examiner"),
    ]


def unpaired(minutiae: Minutiae, paired: Iterable[int]) -> list[int]:
    """Return the indices of all minutiae but the paired ones."""
    return sorted(set(range(len(minutiae))) - set(paired))


def described(minutiae: Minutiae, i: int) -> str:
    """Return kind, place, direction and quality of a minutia as text."""
    kind = _KIND_NAMES[int(minutiae.kind[i])]
    degrees = math.degrees(float(minutiae.angle[i]))
    return (
        f"{kind} at ({minutiae.x[i]:.0f}, {minutiae.y[i]:.0f}), "
        f"direction {degrees:.0f}°, quality {minutiae.quality[i]}"
    )

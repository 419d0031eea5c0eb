"""Minutiae as marks: the shape shows the kind, a tick the direction, the weight the pairing."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.drawing.overlay.page import SAMPLE_WIDTH
from fpmatch.drawing.scene.items import Box, Circle, Path, Pen, directions, moved
from fpmatch.drawing.scene.palette import (
    PAIR_LINK,
    PROBE_FAINT,
    PROBE_MARK,
    REFERENCE_FAINT,
    REFERENCE_MARK,
    TEXT_MUTED,
    Colour,
)
from fpmatch.templates.minutiae import MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.drawing.overlay.page import Entry
    from fpmatch.drawing.scene.items import Matrix, Point
    from fpmatch.templates.minutiae import Minutiae

_SQUARE_SHARE: Final = math.sqrt(math.pi) / 2  # half the side of a square as large as the circle
_KIND_NAMES: Final = ("minutia", "ending", "bifurcation")  # by the values of MinutiaKind


class MarkStyle(NamedTuple):
    """The style of the minutiae of one side; lengths in page pixels."""

    pen: Pen  # of the shape's outline and of the tick
    radius: float  # of an ending's circle; squares and diamonds have about the same area
    tick_px: float  # beyond the shape
    role: str  # the SVG class


PAIRED: Final = {
    "reference": MarkStyle(Pen(REFERENCE_MARK, width=2.2, halo=1.4), 7.5, 11.0, "reference paired"),
    "probe": MarkStyle(Pen(PROBE_MARK, width=2.2, halo=0.8), 4.0, 12.0, "probe paired"),
}
UNPAIRED: Final = {
    "reference": MarkStyle(
        Pen(REFERENCE_FAINT, width=1.3, halo=1.0), 5.0, 8.0, "reference unpaired"
    ),
    "probe": MarkStyle(Pen(PROBE_FAINT, width=1.3, halo=1.0), 3.4, 8.0, "probe unpaired"),
}
PAIR_PEN: Final = Pen(PAIR_LINK, width=2.0, halo=1.2)
EDGES: Final = {
    "reference": Pen(REFERENCE_FAINT, width=1.6, dash=(2.0, 5.0)),
    "probe": Pen(PROBE_FAINT, width=1.6, dash=(9.0, 6.0)),
}
BESIDE_PAIRED: Final = {
    side: MarkStyle(Pen(colour, width=2.2, halo=1.4), 6.0, 10.0, f"{side} paired")
    for side, colour in (("reference", REFERENCE_MARK), ("probe", PROBE_MARK))
}
BESIDE_UNPAIRED: Final = {side: style._replace(radius=4.5) for side, style in UNPAIRED.items()}
_SAMPLE: Final = MarkStyle(Pen(TEXT_MUTED, width=2.2, halo=1.4), 6.0, 10.0, "sample")


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
    matrix: Matrix,
    style: MarkStyle,
    titles: dict[int, str] | None = None,
) -> list[Path | Circle]:
    """Draw the minutiae at `index`, whose pixels `matrix` maps to the page.

    A title, which is that of `described` by default, is shown on hovering.
    """
    points, ways = moved(matrix, minutiae.xy), directions(matrix, minutiae.angle)
    drawn: list[Path | Circle] = []
    for i in index:
        title = described(minutiae, i) if titles is None else titles[i]
        drawn += mark(points[i], ways[i], int(minutiae.kind[i]), style, title)
    return drawn


def described(minutiae: Minutiae, i: int) -> str:
    """Return kind, place, direction and quality of a minutia as text."""
    kind = _KIND_NAMES[int(minutiae.kind[i])]
    degrees = math.degrees(float(minutiae.angle[i]))
    return (
        f"{kind} at ({minutiae.x[i]:.0f}, {minutiae.y[i]:.0f}), "
        f"direction {degrees:.0f}°, quality {minutiae.quality[i]}"
    )


def ridge_sample(meaning: str, ink: Colour) -> Entry:
    """Return the entry of a legend for ridges in an ink."""
    right, pen = SAMPLE_WIDTH - 2, Pen(ink, width=3.4)
    return meaning, [Path(((2, rise), (right, rise)), pen) for rise in (-6.5, 0.0, 6.5)]


def mark_sample(
    meaning: str,
    style: MarkStyle = _SAMPLE,
    kind: MinutiaKind = MinutiaKind.ENDING,
    at: Point = (12.0, 0.0),
) -> Entry:
    """Return the entry of a legend for minutiae."""
    return meaning, mark(at, (1.0, 0.0), kind, style)


KIND_SAMPLES: Final = (
    mark_sample("ending, with direction"),
    mark_sample("bifurcation", kind=MinutiaKind.BIFURCATION),
)

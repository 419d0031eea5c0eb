"""Panels of a picture, and what is drawn in them: points, meshes, rings, unit circles, links.

P is blue with round points, Q orange with square ones, so that the shape distinguishes them too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.page import FRAME_PEN
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.ink import ink_of
from fpmatch.drawing.scene.items import (
    Box,
    Circle,
    Group,
    Path,
    Pen,
    Scene,
    Text,
    bounds,
    moved,
    zoomed,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Item, Matrix, Point
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.lab.explain.steps import Plane, Ring, Side

MARGIN, GAP, TITLE_HEIGHT = 12.0, 24.0, 30.0
WIDTH: Final = 1100.0  # of the panels of a picture and the gaps between them
TALLEST: Final = 640.0
TITLE_SIZE, LABEL_SIZE = 18.0, 17.0
LABEL_RISE: Final = 0.36  # of the size, from the middle of a label down to its baseline
PALE: Final[Colour] = (206, 209, 214)  # of ridges beneath marks
GREY: Final[Colour] = (150, 154, 160)
CIRCLE_SHARE: Final = 0.36  # of the smaller side of a panel: radius of the unit circle
LARGEST_DOT: Final = 30.0  # radius at a weight of 1; the area is proportional to the weight
SQUARE_SHARE: Final = 0.89  # of a radius: half the side of a square as large as the circle
CENTRE: Final = Pen(palette.TEXT, palette.PAPER, width=2.6)  # of a ring
ROOM, BORDER = 0.35, 0.05  # of the extent of a ring, and of all points: around it


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A place on the page, and the matrix that brings what a side shows there."""

    side: Side
    place: Box
    matrix: Matrix

    @classmethod
    def of(cls, side: Side, place: Box, view: Box | None = None) -> Panel:
        """Fit a view, by default that of the whole side, into a place."""
        shown = view or side.view
        zoom = min(place.width / shown.width, place.height / shown.height)
        middle = (shown.x + shown.width / 2, shown.y + shown.height / 2)
        to = (place.x + place.width / 2, place.y + place.height / 2)
        return cls(side, place, zoomed(zoom, middle, to))

    @classmethod
    def of_ring(cls, side: Side, place: Box, ring: Plane, centre: complex) -> Panel:
        """Fit a ring and what is near it into a place."""
        return cls.of(side, place, around(side, np.append(ring, centre), ROOM))

    def at(self, z: Plane) -> list[Point]:
        """Return places in the matcher's frame of the side as places on the page."""
        return moved(self.matrix, self.side.shown(z))

    def drawn(self, title: str, items: Iterable[Item], colour: Colour = PALE) -> list[Item]:
        """Draw the print beneath `items`, a frame around them, and a title above."""
        print_ = self.side.print_
        ink: tuple[Item, ...] = ()
        if print_ is not None:
            ink = ink_of(print_.pixels, print_.template, self.matrix, colour, "ridges")
        return framed(self.place, title, (*ink, *items), self.side.mark)


def around(side: Side, z: Plane, room: float) -> Box:
    """Return the part of a side that shows places, and `room` of their extent around them."""
    box = bounds([(x, y) for x, y in side.shown(z).tolist()])
    return box.grown(room * max(box.width, box.height) or 1.0)


def framed(
    place: Box, title: str, items: Sequence[Item], colour: Colour = palette.TEXT
) -> list[Item]:
    """Draw items in a place, a frame around them, and a title above."""
    above = Text(place.x, place.y - 9, title, TITLE_SIZE, colour, bold=0.3)
    frame = Path(place.grown(0.5).corners, FRAME_PEN, closed=True)
    return [Group(tuple(items), place), frame, above]


def places(shares: Sequence[float], height: float) -> list[Box]:
    """Return panels from left to right, whose widths have these proportions."""
    room = WIDTH - GAP * (len(shares) - 1)
    widths = [room * share / sum(shares) for share in shares]
    lefts = [MARGIN + sum(widths[:k]) + GAP * k for k in range(len(widths))]
    return [Box(x, MARGIN + TITLE_HEIGHT, w, height) for x, w in zip(lefts, widths, strict=True)]


def two_panels(sides: Sequence[Side]) -> list[Panel]:
    """Return the panels of both sides, as tall as what they show."""
    width = places((1, 1), 0.0)[0].width
    tallest = max(width * side.view.height / side.view.width for side in sides)
    boxes = places((1, 1), min(max(tallest, width / 3), TALLEST))
    return [Panel.of(side, box) for side, box in zip(sides, boxes, strict=True)]


def one_panel(side: Side, z: Plane | None = None) -> Panel:
    """Return a panel of the whole width for a side, or for places in it."""
    view = side.view if z is None else around(side, z, BORDER)
    height = min(max(WIDTH * view.height / view.width, WIDTH / 6), TALLEST)
    return Panel.of(side, places((1,), height)[0], view)


def picture(items: Sequence[Item], description: str) -> Scene:
    """Return the picture of panels, as tall as the tallest of them."""
    bottom = max(item.clip.bottom for item in items if isinstance(item, Group))
    size = math.ceil(WIDTH + 2 * MARGIN), math.ceil(bottom + MARGIN)
    return Scene(*size, tuple(items), description)


def dots(panel: Panel, z: Plane, radius: float = 4.0, *, hollow: bool = False) -> list[Item]:
    """Draw points in the shape of their side."""
    mark = panel.side.mark
    pen = Pen(mark, palette.PAPER if hollow else mark, width=1.6)
    return [shape(panel.side.letter, at, radius, pen) for at in panel.at(z)]


def shape(letter: str, at: Point, radius: float, pen: Pen) -> Item:
    """Draw a round point of P, or a square one of Q."""
    if letter == "P":
        return Circle(at, radius, pen)
    return Path(Box(*at, 0.0, 0.0).grown(SQUARE_SHARE * radius).corners, pen, closed=True)


def segments(starts: Iterable[Point], ends: Iterable[Point], pen: Pen) -> list[Item]:
    """Draw straight lines."""
    return [Path((a, b), pen) for a, b in zip(starts, ends, strict=True)]


def edges(panel: Panel, ends: Plane, colour: Colour = GREY) -> list[Item]:
    """Draw the edges of a mesh that may be seen, by their ends, shape (E, 2)."""
    both = np.stack([panel.at(ends[:, k]) for k in range(2)]).reshape(2, -1, 2)
    (x, y), (right, bottom) = panel.place.corners[::2]
    seen = (both.max(axis=0) >= (x, y)) & (both.min(axis=0) <= (right, bottom))
    starts, stops = both[:, seen.all(axis=1)].tolist()
    return segments(starts, stops, Pen(colour, width=1.3))


def label(at: Point, text: str, away: NDArray[np.float64], distance: float = 15.0) -> Text:
    """Write a short text near a point, on the side that points `away`."""
    dx, dy = (away / (math.hypot(*away) or 1.0) * distance).tolist()
    x, y = at[0] + dx, at[1] + dy + LABEL_RISE * LABEL_SIZE
    return Text(x, y, text, LABEL_SIZE, palette.TEXT, "middle", bold=0.4, halo=3.0)


def ring(panel: Panel, of: Ring, which: int, weights: NDArray[np.float64]) -> list[Item]:
    """Draw a ring, its points numbered and as large as their weights, its spokes and its centre."""
    at, side = panel.at(of.points[which]), panel.side
    (middle,), around = panel.at(np.array([of.centres[which]])), np.mean(at, axis=0)
    items: list[Item] = [Path(tuple(at), Pen(fill=side.ink, opacity=0.22), closed=True)]
    items += segments(at, [middle] * len(at), Pen(side.mark, width=1.4))
    items.append(Path(tuple(at), Pen(side.mark, width=2.6), closed=True))
    for n, (point, weight) in enumerate(zip(at, weights.tolist(), strict=True), start=1):
        radius = LARGEST_DOT * math.sqrt(max(weight, 0.0))
        items.append(shape(side.letter, point, radius, Pen(palette.PAPER, side.mark, width=1.5)))
        items.append(label(point, str(n), np.subtract(point, around), radius + LABEL_SIZE * 0.8))
    return [*items, shape(side.letter, middle, 6.0, CENTRE)]


def circle_ground(place: Box) -> Item:
    """Draw the unit circle in a place."""
    return Circle(*_circle(place), Pen(palette.NEUTRAL_INK, palette.BAND, width=1.6))


def circle_ring(
    place: Box, layer: int, side: Side, angles: NDArray[np.float64], image: complex | None
) -> list[Item]:
    """Draw a ring on the unit circle, full and numbered in layer 0, hollow and larger in layer 1.

    The image of its centre is drawn where it is known.
    """
    (x, y), radius = _circle(place)
    sense = -radius if side.up else radius
    z = np.exp(1j * angles)
    spots = list(zip((x + radius * z.real).tolist(), (y + sense * z.imag).tolist(), strict=True))
    pen = Pen(side.mark, None if layer else side.mark, width=2.2)
    items: list[Item] = [Path(tuple(spots), Pen(side.mark, width=2.0), closed=True)]
    if image is not None:
        at = x + radius * image.real, y + sense * image.imag
        items += segments(spots, [at] * len(spots), Pen(side.mark, width=1.2))
        items.append(shape(side.letter, at, 6.0 + 2.5 * layer, pen))
    for n, spot in enumerate(spots, start=1):
        items.append(shape(side.letter, spot, 5.0 + 3.0 * layer, pen))
        if not layer:
            items.append(label(spot, str(n), np.subtract(spot, (x, y)), 22.0))
    return items


def _circle(place: Box) -> tuple[Point, float]:
    """Return middle and radius of the unit circle in a place."""
    middle = place.x + place.width / 2, place.y + place.height / 2
    return middle, CIRCLE_SHARE * min(place.width, place.height)

"""Numbers beside marks, placed where they cover the least."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.fonts import text_width
from fpmatch.drawing.scene.items import Box, Point, Text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.drawing.palette import Colour

_SIZE: Final = 14.0
_CAP_HEIGHT: Final = 0.72  # of the size: how high digits stand
_HALO: Final = 2.0
_DISTANCE: Final = 10.0  # from the mark's centre to the nearest edge of its number
_PLACES: Final = 16
_TURNED_AWAY: Final = 6.0  # page pixels of overlap that lying behind the tick is worth
_OUTSIDE: Final = 4.0  # times as bad to leave the panel as to cover something


def place_labels(
    texts: Sequence[str],
    points: Sequence[Point],
    directions: Sequence[Point],
    obstacles: Sequence[Box],
    panel: Box,
    colour: Colour,
) -> list[Text]:
    """Place a short text beside each point, one after the other, each where it covers least.

    Parameters
    ----------
    texts : sequence of str
        What to write.
    points, directions : sequence of Point
        Where the marks lie and the unit vectors of their ticks, which texts keep away from.
    obstacles : sequence of Box
        What should stay visible; the texts placed earlier are added to it.
    panel : Box
        What the texts should not leave.
    colour : Colour
        Of the letters.

    Returns
    -------
    list of Text
        One for each point, in the same order.
    """
    taken = list(obstacles)
    placed: list[Text] = []
    for text, point, direction in zip(texts, points, directions, strict=True):
        width, height = text_width(text, _SIZE), _SIZE * _CAP_HEIGHT

        def cost(box: Box, way: Point, tick: Point = direction) -> float:
            covered = sum(box.overlap(other) for other in taken)
            outside = box.width * box.height - box.overlap(panel)
            return covered + _OUTSIDE * outside + _TURNED_AWAY * _along(way, tick)

        ways = [_unit(2 * math.pi * k / _PLACES) for k in range(_PLACES)]
        candidates = [(_beside(point, way, width, height), way) for way in ways]
        box, _ = min(candidates, key=lambda candidate: cost(*candidate))
        taken.append(box.grown(1))
        placed.append(
            Text(box.x, box.bottom, text, _SIZE, colour, halo=_HALO, bold=0.3, role="number")
        )
    return placed


def _unit(angle: float) -> Point:
    return math.cos(angle), math.sin(angle)


def _along(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _beside(point: Point, way: Point, width: float, height: float) -> Box:
    """Return the box of a text that touches a circle around `point` on the side of `way`."""
    x = point[0] + way[0] * (_DISTANCE + width / 2)
    y = point[1] + way[1] * (_DISTANCE + height / 2)
    return Box(x - width / 2, y - height / 2, width, height)

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
_CAP_HEIGHT: Final = 0.72  # of the size: height of digits
_HALO: Final = 2.0
_DISTANCE: Final = 10.0  # from the mark's centre to the nearest edge of its number
_PLACES: Final = 16
_TICK_COST: Final = 6.0  # page pixels of overlap that equal a place in the tick's direction
_OUTSIDE_COST: Final = 4.0  # of leaving the panel, in costs of covering something


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
        One for each point.
    points, directions : sequence of Point
        The marks, and the unit vectors of their ticks, which texts avoid.
    obstacles : sequence of Box
        What should stay visible, besides the texts placed earlier.
    panel : Box
        The texts should not leave it.
    colour : Colour
        Colour of the letters.

    Returns
    -------
    list of Text
        One for each point, in the same order.
    """
    taken = list(obstacles)
    placed: list[Text] = []
    angles = (2 * math.pi * k / _PLACES for k in range(_PLACES))
    ways = [(math.cos(angle), math.sin(angle)) for angle in angles]
    for text, (x, y), (tick_x, tick_y) in zip(texts, points, directions, strict=True):
        width, height = text_width(text, _SIZE), _SIZE * _CAP_HEIGHT
        candidates = []
        for dx, dy in ways:
            left = x + dx * (_DISTANCE + width / 2) - width / 2
            top = y + dy * (_DISTANCE + height / 2) - height / 2
            box = Box(left, top, width, height)
            covered = sum(box.overlap(other) for other in taken)
            outside = width * height - box.overlap(panel)
            along = dx * tick_x + dy * tick_y
            candidates.append((covered + _OUTSIDE_COST * outside + _TICK_COST * along, box))
        _, best = min(candidates, key=lambda candidate: candidate[0])
        taken.append(best.grown(1))
        placed.append(
            Text(best.x, best.bottom, text, _SIZE, colour, halo=_HALO, bold=0.3, role="number")
        )
    return placed

"""The page of two prints side by side: each as it was taken, the pairs numbered."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.overlay.legend import side_by_side_legend
from fpmatch.drawing.overlay.marks import (
    BESIDE_PAIRED,
    BESIDE_UNPAIRED,
    examiner_marks,
    marks,
    unpaired,
)
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Item,
    Path,
    Pen,
    Point,
    Scene,
    Text,
    direction_on_page,
    moved,
    of_transform,
    zoomed,
)
from fpmatch.drawing.scene.palette import NEUTRAL_INK, TEXT
from fpmatch.printable import count
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.marks import ExaminerMark
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.verification import Verification

_COMFORTABLE_SIDE: Final = 760.0  # page pixels of each print
_LEAST_SIDE: Final = 360.0
_BORDER: Final = 8.0
_TITLE_HEIGHT: Final = 26.0
_TITLE_SIZE: Final = 16.0
_LINK_PEN: Final = Pen(TEXT, width=1.0, opacity=0.25)
_MARK_REACH: Final = 7.0  # page pixels around a minutia that numbers avoid
_SIZE, _HALO = 14.0, 2.0  # of numbers
_CAP_HEIGHT: Final = 0.72  # of the size: height of digits
_DISTANCE: Final = 10.0  # from the mark's centre to the nearest edge of its number
_PLACES: Final = 16
_TICK_COST: Final = 6.0  # page pixels of overlap that equal a place in the tick's direction
_OUTSIDE_COST: Final = 4.0  # of leaving the panel, in costs of covering something


@dataclass(frozen=True, slots=True)
class _Side:
    """One print of the page, its role, and the indices of its paired minutiae."""

    role: str
    print_: Print
    indices: list[int]

    @property
    def size_at_500_dpi(self) -> tuple[float, float]:
        """Width and height; both prints are shown at the same resolution."""
        t = self.print_.template
        return t.width * STANDARD_DPI / t.dpi, t.height * STANDARD_DPI / t.dpi

    def placed(self, zoom: float, panel: Box) -> NDArray[np.float64]:
        """Return the matrix that centres the print in its panel."""
        t = self.print_.template
        middle = (panel.x + panel.width / 2, panel.y + panel.height / 2)
        own = zoom * STANDARD_DPI / t.dpi
        return zoomed(own, ((t.width - 1) / 2, (t.height - 1) / 2), middle)


def side_by_side_page(
    probe: Print, reference: Print, verification: Verification, own: Sequence[ExaminerMark] = ()
) -> Scene:
    """Compose the page; the pairs of `verification` are numbered in their order, from 1.

    Marks that an examiner set, `own`, are drawn on both prints where the transform is known.
    """
    pairs = verification.pairs.reshape(-1, 2)
    i, j = pairs.T.tolist()
    sides = _Side("probe", probe, i), _Side("reference", reference, j)
    longest = max(length for side in sides for length in side.size_at_500_dpi)
    zoom = comfortable_zoom(longest, _COMFORTABLE_SIDE)
    widths = [_panel_side(zoom * side.size_at_500_dpi[0]) for side in sides]
    height = max(_panel_side(zoom * side.size_at_500_dpi[1]) for side in sides)

    def panel(place: Box) -> list[Item]:
        lefts, top = (place.x, place.right - widths[1]), place.y + _TITLE_HEIGHT
        boxes = [Box(x, top, w, height) for x, w in zip(lefts, widths, strict=True)]
        placed = [(s, s.placed(zoom, box), box) for s, box in zip(sides, boxes, strict=True)]
        starts, ends = (moved(m, side.print_.template.minutiae.xy) for side, m, _ in placed)
        ours, theirs = (matrix for _, matrix, _ in placed)
        transform = verification.transform
        onto = None if transform is None else of_transform(transform)
        others = (None, None) if onto is None else (ours @ np.linalg.inv(onto), theirs @ onto)
        return [
            *(item for side in placed for item in _ground(*side)),
            *(
                Path((starts[a], ends[b]), _LINK_PEN, role="pair", title=f"pair {n}")
                for n, (a, b) in enumerate(zip(i, j, strict=True), start=1)
            ),
            *(item for side in placed for item in _minutiae(*side)),
            *(
                item
                for (side, matrix, box), other in zip(placed, others, strict=True)
                for item in examiner_marks(own, side.role, matrix, other, box)
            ),
        ]

    size = (widths[0] + MARGIN + widths[1], height + _TITLE_HEIGHT)
    return page(verification, size, panel, partial(side_by_side_legend, paired=bool(len(pairs))))


def _panel_side(length: float) -> float:
    return max(round(length + 2 * _BORDER), _LEAST_SIDE)


def _ground(side: _Side, matrix: NDArray[np.float64], panel: Box) -> list[Item]:
    """Draw the title, the ridges and the frame of one print."""
    t = side.print_.template
    size = f"{t.width} x {t.height} px, {t.dpi:g} dpi"
    title = f"{side.role.title()}: {count(len(t.minutiae), 'minutia', 'minutiae')}, {size}"
    ink = ink_of(side.print_, matrix, NEUTRAL_INK, f"{side.role} ridges")
    return [
        Text(panel.x, panel.y - 9, title, _TITLE_SIZE, BESIDE_PAIRED[side.role].colour),
        Group((ink,) if ink else (), panel, side.role),
        frame(panel),
    ]


def _minutiae(side: _Side, matrix: NDArray[np.float64], panel: Box) -> list[Item]:
    """Draw the minutiae of one print, and the numbers of the paired ones."""
    minutiae, paired, style = side.print_.template.minutiae, side.indices, BESIDE_PAIRED[side.role]
    places = moved(matrix, minutiae.xy)
    directions = [direction_on_page(matrix, float(angle)) for angle in minutiae.angle]
    obstacles = [Box(*place, 0, 0).grown(_MARK_REACH) for place in places]
    marked = [(places[i], directions[i]) for i in paired]
    rest = BESIDE_UNPAIRED[side.role] if paired else style
    return [
        *marks(minutiae, unpaired(minutiae, paired), matrix, rest, panel),
        *marks(minutiae, paired, matrix, style, panel),
        *place_numbers(marked, obstacles, panel, style.colour),
    ]


def place_numbers(
    marked: Sequence[tuple[Point, Point]], obstacles: Sequence[Box], panel: Box, colour: Colour
) -> list[Text]:
    """Place a number, from 1, beside each mark, one after the other, each where it covers least.

    A mark is its place and the unit vector of its tick, which numbers avoid; `obstacles` should
    stay visible, besides the numbers placed earlier; numbers should not leave the `panel`.
    """
    taken = list(obstacles)
    placed: list[Text] = []
    angles = (2 * math.pi * k / _PLACES for k in range(_PLACES))
    ways = [(math.cos(angle), math.sin(angle)) for angle in angles]
    for n, ((x, y), (tick_x, tick_y)) in enumerate(marked, start=1):
        width, height = text_width(str(n), _SIZE), _SIZE * _CAP_HEIGHT
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
            Text(best.x, best.bottom, str(n), _SIZE, colour, bold=0.3, halo=_HALO, role="number")
        )
    return placed

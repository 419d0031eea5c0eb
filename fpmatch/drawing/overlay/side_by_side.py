"""The page of two prints beside each other: each upright as it was taken, the pairs numbered."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.overlay.labels import place_labels
from fpmatch.drawing.overlay.legend import (
    BESIDE_PROBE_PAIRED,
    BESIDE_PROBE_UNPAIRED,
    BESIDE_REFERENCE_PAIRED,
    BESIDE_REFERENCE_UNPAIRED,
    side_by_side_legend,
)
from fpmatch.drawing.overlay.marks import MarkStyle, marks
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.palette import NEUTRAL_INK, TEXT
from fpmatch.drawing.scene.items import Box, Group, Item, Path, Pen, Scene, Text
from fpmatch.drawing.scene.placement import direction_on_page, moved, zoomed
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Point
    from fpmatch.matching.result import Verification

_COMFORTABLE_SIDE: Final = 760.0  # page pixels of each print
_LEAST_SIDE: Final = 360.0
_BORDER: Final = 8.0
_TITLE_HEIGHT: Final = 26.0
_TITLE_SIZE: Final = 16.0
_JOIN_PEN: Final = Pen(TEXT, width=1.0, opacity=0.25)
_MARK_REACH: Final = 7.0  # page pixels around a minutia that numbers leave free


@dataclass(frozen=True, slots=True)
class _Side:
    """Hold what tells the two prints of the page apart."""

    title: str
    print_: Print
    indices: list[int]
    paired: MarkStyle
    unpaired: MarkStyle

    @property
    def size_at_500_dpi(self) -> tuple[float, float]:
        """Width and height, so that both prints are shown equally large."""
        t = self.print_.template
        return t.width * STANDARD_DPI / t.dpi, t.height * STANDARD_DPI / t.dpi

    def placed(self, zoom: float, panel: Box) -> NDArray[np.float64]:
        """Return the matrix that centres the print in its panel."""
        t = self.print_.template
        middle = (panel.x + panel.width / 2, panel.y + panel.height / 2)
        own = zoom * STANDARD_DPI / t.dpi
        return zoomed(own, ((t.width - 1) / 2, (t.height - 1) / 2), middle)


def side_by_side(probe: Print, reference: Print, verification: Verification) -> Scene:
    """Compose the page on which the prints stand beside each other.

    Parameters
    ----------
    probe, reference : Print
        The two sides.
    verification : Verification
        Their comparison; its pairs are numbered in their order, from 1.

    Returns
    -------
    Scene
        The page.
    """
    pairs = [(int(i), int(j)) for i, j in verification.pairs.reshape(-1, 2)]
    left = _Side("Probe", probe, [i for i, _ in pairs], BESIDE_PROBE_PAIRED, BESIDE_PROBE_UNPAIRED)
    right = _Side(
        "Reference",
        reference,
        [j for _, j in pairs],
        BESIDE_REFERENCE_PAIRED,
        BESIDE_REFERENCE_UNPAIRED,
    )
    zoom = comfortable_zoom(max(*left.size_at_500_dpi, *right.size_at_500_dpi), _COMFORTABLE_SIDE)
    widths = [_panel_side(zoom * side.size_at_500_dpi[0]) for side in (left, right)]
    height = max(_panel_side(zoom * side.size_at_500_dpi[1]) for side in (left, right))

    def panel(place: Box) -> list[Item]:
        top = place.y + _TITLE_HEIGHT
        boxes = (
            Box(place.x, top, widths[0], height),
            Box(place.right - widths[1], top, widths[1], height),
        )
        matrices = [side.placed(zoom, box) for side, box in zip((left, right), boxes, strict=True)]
        joins = _joins(left, right, matrices)
        grounds = [
            item
            for side, matrix, box in zip((left, right), matrices, boxes, strict=True)
            for item in _ground(side, matrix, box)
        ]
        found = [
            item
            for side, matrix, box in zip((left, right), matrices, boxes, strict=True)
            for item in _minutiae(side, matrix, box)
        ]
        return [*grounds, *joins, *found]

    size = (widths[0] + MARGIN + widths[1], height + _TITLE_HEIGHT)
    return page(verification, size, panel, partial(side_by_side_legend, paired=bool(pairs)))


def _panel_side(length: float) -> float:
    return max(round(length + 2 * _BORDER), _LEAST_SIDE)


def _ground(side: _Side, matrix: NDArray[np.float64], panel: Box) -> list[Item]:
    """Draw the title, the ridges and the frame of one print."""
    role = side.title.lower()
    t = side.print_.template
    words = f"{side.title}: {len(t.minutiae)} minutiae, {t.width} x {t.height} px, {t.dpi:g} dpi"
    ink = ink_of(side.print_, matrix, NEUTRAL_INK, f"{role} ridges")
    return [
        Text(panel.x, panel.y - 9, words, _TITLE_SIZE, side.paired.colour),
        Group((ink,) if ink else (), panel, role),
        frame(panel),
    ]


def _joins(left: _Side, right: _Side, matrices: list[NDArray[np.float64]]) -> list[Item]:
    starts = moved(matrices[0], left.print_.template.minutiae.xy)
    ends = moved(matrices[1], right.print_.template.minutiae.xy)
    return [
        Path((starts[i], ends[j]), _JOIN_PEN, role="pair", title=f"pair {n}")
        for n, (i, j) in enumerate(zip(left.indices, right.indices, strict=True), start=1)
    ]


def _minutiae(side: _Side, matrix: NDArray[np.float64], panel: Box) -> list[Item]:
    """Draw the minutiae of one print, and the numbers of those that are paired."""
    minutiae = side.print_.template.minutiae
    rest = sorted(set(range(len(minutiae))) - set(side.indices))
    places = moved(matrix, minutiae.xy)
    directions = [direction_on_page(matrix, float(angle)) for angle in minutiae.angle]
    numbers = place_labels(
        [str(n) for n in range(1, len(side.indices) + 1)],
        [places[i] for i in side.indices],
        [directions[i] for i in side.indices],
        [_around(places[i]) for i in range(len(minutiae))],
        panel,
        side.paired.colour,
    )
    return [
        *marks(minutiae, rest, matrix, side.unpaired if side.indices else side.paired, panel),
        *marks(minutiae, side.indices, matrix, side.paired, panel),
        *numbers,
    ]


def _around(point: Point) -> Box:
    return Box(point[0], point[1], 0, 0).grown(_MARK_REACH)

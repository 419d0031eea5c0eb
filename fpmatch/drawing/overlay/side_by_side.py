"""The page of two prints beside each other: each as it was taken, the pairs numbered."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.overlay.labels import place_labels
from fpmatch.drawing.overlay.legend import side_by_side_legend
from fpmatch.drawing.overlay.marks import (
    BESIDE_PROBE_PAIRED,
    BESIDE_PROBE_UNPAIRED,
    BESIDE_REFERENCE_PAIRED,
    BESIDE_REFERENCE_UNPAIRED,
    MarkStyle,
    marks,
    unpaired,
)
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.palette import NEUTRAL_INK, TEXT
from fpmatch.drawing.scene.items import Box, Group, Item, Path, Pen, Scene, Text
from fpmatch.drawing.scene.placement import direction_on_page, moved, zoomed
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.matching.result import Verification

_COMFORTABLE_SIDE: Final = 760.0  # page pixels of each print
_LEAST_SIDE: Final = 360.0
_BORDER: Final = 8.0
_TITLE_HEIGHT: Final = 26.0
_TITLE_SIZE: Final = 16.0
_LINK_PEN: Final = Pen(TEXT, width=1.0, opacity=0.25)
_MARK_REACH: Final = 7.0  # page pixels around a minutia that numbers avoid


@dataclass(frozen=True, slots=True)
class _Side:
    """Hold one print of the page, the indices of its paired minutiae, and its styles."""

    title: str
    print_: Print
    indices: list[int]
    paired: MarkStyle
    unpaired: MarkStyle

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


def side_by_side_page(probe: Print, reference: Print, verification: Verification) -> Scene:
    """Compose the page; the pairs of `verification` are numbered in their order, from 1."""
    pairs = verification.pairs.reshape(-1, 2)
    i, j = pairs.T.tolist()
    sides = (
        _Side("Probe", probe, i, BESIDE_PROBE_PAIRED, BESIDE_PROBE_UNPAIRED),
        _Side("Reference", reference, j, BESIDE_REFERENCE_PAIRED, BESIDE_REFERENCE_UNPAIRED),
    )
    longest = max(length for side in sides for length in side.size_at_500_dpi)
    zoom = comfortable_zoom(longest, _COMFORTABLE_SIDE)
    widths = [_panel_side(zoom * side.size_at_500_dpi[0]) for side in sides]
    height = max(_panel_side(zoom * side.size_at_500_dpi[1]) for side in sides)

    def panel(place: Box) -> list[Item]:
        top = place.y + _TITLE_HEIGHT
        boxes = (
            Box(place.x, top, widths[0], height),
            Box(place.right - widths[1], top, widths[1], height),
        )
        placed = [
            (side, side.placed(zoom, box), box) for side, box in zip(sides, boxes, strict=True)
        ]
        starts, ends = (moved(m, side.print_.template.minutiae.xy) for side, m, _ in placed)
        return [
            *(item for side in placed for item in _ground(*side)),
            *(
                Path((starts[a], ends[b]), _LINK_PEN, role="pair", title=f"pair {n}")
                for n, (a, b) in enumerate(zip(i, j, strict=True), start=1)
            ),
            *(item for side in placed for item in _minutiae(*side)),
        ]

    size = (widths[0] + MARGIN + widths[1], height + _TITLE_HEIGHT)
    return page(verification, size, panel, partial(side_by_side_legend, paired=bool(len(pairs))))


def _panel_side(length: float) -> float:
    return max(round(length + 2 * _BORDER), _LEAST_SIDE)


def _ground(side: _Side, matrix: NDArray[np.float64], panel: Box) -> list[Item]:
    """Draw the title, the ridges and the frame of one print."""
    role, t = side.title.lower(), side.print_.template
    title = f"{side.title}: {len(t.minutiae)} minutiae, {t.width} x {t.height} px, {t.dpi:g} dpi"
    ink = ink_of(side.print_, matrix, NEUTRAL_INK, f"{role} ridges")
    return [
        Text(panel.x, panel.y - 9, title, _TITLE_SIZE, side.paired.colour),
        Group((ink,) if ink else (), panel, role),
        frame(panel),
    ]


def _minutiae(side: _Side, matrix: NDArray[np.float64], panel: Box) -> list[Item]:
    """Draw the minutiae of one print, and the numbers of the paired ones."""
    minutiae, paired = side.print_.template.minutiae, side.indices
    places = moved(matrix, minutiae.xy)
    directions = [direction_on_page(matrix, float(angle)) for angle in minutiae.angle]
    numbers = place_labels(
        [str(n) for n in range(1, len(paired) + 1)],
        [places[i] for i in paired],
        [directions[i] for i in paired],
        [Box(*place, 0, 0).grown(_MARK_REACH) for place in places],
        panel,
        side.paired.colour,
    )
    rest = unpaired(minutiae, paired)
    return [
        *marks(minutiae, rest, matrix, side.unpaired if paired else side.paired, panel),
        *marks(minutiae, paired, matrix, side.paired, panel),
        *numbers,
    ]

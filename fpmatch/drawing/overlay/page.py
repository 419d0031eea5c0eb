"""The parts that every page shares: magnification, the frame of a panel, and the legend."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeAlias

from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.items import Box, Circle, Group, Item, Path, Pen, Scene, Text
from fpmatch.drawing.scene.palette import PANEL_EDGE, TEXT
from fpmatch.printable import count
from fpmatch.prints.report import odds, outcome

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.drawing.scene.items import Placed
    from fpmatch.matching.verification import Verification

Entry: TypeAlias = "tuple[str, Iterable[Path | Circle]]"
"""A meaning, and its sample in a box 34 wide whose middle of the left side is (0, 0)."""

_LARGEST_ZOOM: Final = 3.0
LARGEST_PANEL_SIDE: Final = 2000.0  # page pixels
FRAME_PEN: Final = Pen(PANEL_EDGE, width=1.0)
LEGEND_SIZE, _ROW, SAMPLE_WIDTH, _GAP = 14.0, 30.0, 34.0, 24.0


def comfortable_zoom(side: float, comfortable: float) -> float:
    """Return the magnification at which marks are crisp and the page fits a screen.

    A view whose longer `side`, in pixels of its print, is less than `comfortable` page pixels is
    magnified towards them; a larger one is shrunk only where it would exceed the largest panel.
    """
    zoom = min(max(comfortable / side, 1.0), _LARGEST_ZOOM)
    return min(zoom, LARGEST_PANEL_SIDE / side)


def frame(panel: Box) -> Path:
    """Draw the line around a panel, just outside it."""
    return Path(panel.grown(0.5).corners, FRAME_PEN, closed=True)


def page(
    verification: Verification,
    caption: Group,
    panel: Iterable[Item],
    entries: Iterable[Entry],
    bottom: float,
    placed: tuple[Placed, ...],
) -> Scene:
    """Compose a page: a `caption`, the items of a panel, and a legend below `bottom`.

    The panel's prints are `placed`.
    """
    v, width = verification, caption.clip.width
    x, y = MARGIN, bottom + 10 + _ROW / 2
    legend: list[Item] = []
    for meaning, sample in entries:
        needed = SAMPLE_WIDTH + 8 + text_width(meaning, LEGEND_SIZE)
        if x > MARGIN and x + needed > width - MARGIN:
            x, y = MARGIN, y + _ROW
        for shape in sample:
            if isinstance(shape, Circle):
                legend.append(shape._replace(centre=(x + shape.centre[0], y + shape.centre[1])))
            else:
                legend.append(shape._replace(points=tuple((x + a, y + b) for a, b in shape.points)))
        legend.append(Text(x + SAMPLE_WIDTH + 8, y + 5, meaning, LEGEND_SIZE, TEXT))
        x += needed + _GAP
    height = math.ceil(y + _ROW / 2 + 12)
    items = caption, *panel, Group(tuple(legend), Box(0, bottom, width, height - bottom), "legend")
    rate = f"false match rate {odds(v.fmr)}, " if v.identical is None else ""
    description = (
        f"{outcome(v)}: score {v.score:.1f}, threshold {v.threshold:.1f}, {rate}"
        f"{count(len(v.pairs), 'pair')} of minutiae"
    )
    return Scene(math.ceil(width), height, items, description, placed)

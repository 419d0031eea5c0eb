"""The page of the ridge agreement: the reference, its cells coloured by how well they agree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.caption import MARGIN, header
from fpmatch.drawing.overlay.marks import (
    BESIDE_PAIRED,
    described,
    mark_sample,
    marks,
    ridge_sample,
)
from fpmatch.drawing.overlay.page import LEGEND_SIZE, comfortable_zoom, frame, page
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.ink import ink_of
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Item,
    Path,
    Pen,
    Scene,
    Text,
    bounds,
    moved,
    of_transform,
    zoomed,
)
from fpmatch.matching.constants.comparison import IMPOSTOR_RIDGES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.page import Entry
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.matching.verification import Verification

_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown
_INK: Final[palette.Colour] = (70, 72, 76)
_STEPS: Final = 64  # of the scale of colours
_AGREEMENTS: Final = (
    *((0.0, "0"), (IMPOSTOR_RIDGES, f"{IMPOSTOR_RIDGES:.2g}: mean of different fingers")),
    *((0.6, "0.6"), (0.8, "0.8"), (1.0, "1: the ridges coincide")),
)

# From low to high, along blue and yellow and from dark to light: pale relatives of cividis (Nuñez,
# Anderton, Renslow, PLOS ONE 13(7), 2018), so that ridges stay legible on them.
AGREEMENT: Final[tuple[Colour, ...]] = (
    *((84, 118, 178), (136, 158, 192), (196, 198, 198)),
    *((228, 218, 158), (255, 234, 96)),
)


_NOT_COMPARED: Final = Path(
    Box(8, -8, 16, 16).corners, Pen(palette.PANEL_EDGE, palette.PAPER), closed=True
)
_LEGEND: Final[tuple[Entry, ...]] = (
    ridge_sample("reference ridges", palette.NEUTRAL_INK),
    mark_sample("paired minutia of reference", BESIDE_PAIRED["reference"]),
    ("not compared", (_NOT_COMPARED,)),
)


def ridge_page(image: NDArray[np.uint8], verification: Verification, ridges: RidgeMap) -> Scene:
    """Compose the page of the `image` of the reference with the cells of `ridges`."""
    v, t = verification, verification.reference
    own = Box(-0.5, -0.5, t.width, t.height)
    shown = np.vstack([own.corners, ridges.corners.reshape(-1, 2)])
    view = bounds(moved(np.eye(3), shown)).grown(_BORDER_PX)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)
    caption, place = header(v, (round(view.width * zoom), round(view.height * zoom)))
    to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
    values = ridges.correlation.tolist()
    pens = [Pen(agreement(value), agreement(value)) for value in values]
    j = v.pairs.reshape(-1, 2)[:, 1].tolist()
    titles = {
        b: f"pair {n}: reference {described(t.minutiae, b)}" for n, b in enumerate(j, start=1)
    }
    inside: tuple[Item, ...] = (
        *(
            Path(tuple(moved(to_page, corners)), pen, True, "cell", f"ridge agreement {value:.2f}")
            for corners, pen, value in zip(ridges.corners, pens, values, strict=True)
        ),
        *ink_of(image, t, to_page, _INK, "reference ridges"),
        *marks(t.minutiae, j, to_page, BESIDE_PAIRED["reference"], titles),
    )
    area = 0.0 if v.compared is None else v.compared.ridge_area_mm2
    scale, bottom = _scale(caption.clip.width, place.bottom + 10, ridges.mean, area)
    panel = [Group(inside, place, "ridge agreement"), frame(place), *scale]
    there = None if v.transform is None else to_page @ of_transform(v.transform)
    return page(v, caption, panel, _LEGEND, bottom, (("reference", to_page, there, place),))


def _scale(width: float, top: float, mean: float, area_mm2: float) -> tuple[list[Item], float]:
    """Compose the scale of colours from `top` down; returns its items and the end of its height."""
    bar = Box(MARGIN + 70, top + 30, width - 2 * MARGIN - 140, 16)
    items: list[Item] = []
    for k in range(_STEPS):
        colour = agreement((k + 0.5) / _STEPS)
        box = Box(bar.x + bar.width * k / _STEPS, bar.y, bar.width / _STEPS, bar.height)
        items.append(Path(box.corners, Pen(colour, colour), closed=True))
    items.append(Path(bar.corners, Pen(palette.TEXT_MUTED), closed=True))
    above = f"agreement of the ridges of this comparison: {mean:.2f} on {area_mm2:.0f} mm²"
    items += _tick(bar, mean, above, bar.y - 12, palette.TEXT)
    for value, words in _AGREEMENTS:
        items += _tick(bar, value, words, bar.bottom + 22, palette.TEXT_MUTED)
    return items, bar.bottom + 22


def _tick(bar: Box, value: float, words: str, baseline: float, colour: Colour) -> list[Item]:
    """Mark a value of a scale of 0 to 1, with words above or below it."""
    x = bar.x + bar.width * min(max(value, 0.0), 1.0)
    half = text_width(words, LEGEND_SIZE) / 2
    middle = min(max(x, MARGIN + half), bar.right + 70 - half)
    ends = (bar.y - 8, bar.bottom) if baseline < bar.y else (bar.y, bar.bottom + 6)
    line = Path(((x, ends[0]), (x, ends[1])), Pen(palette.TEXT, width=2.0))
    return [line, Text(middle, baseline, words, LEGEND_SIZE, colour, "middle")]


def agreement(value: float) -> Colour:
    """Return the colour of an agreement of ridges: the lowest for 0 and less, the highest for 1."""
    place = min(max(value, 0.0), 1.0) * (len(AGREEMENT) - 1)
    k = min(int(place), len(AGREEMENT) - 2)
    low, high, share = AGREEMENT[k], AGREEMENT[k + 1], place - k
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue

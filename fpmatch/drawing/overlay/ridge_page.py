"""The page of the ridge agreement: the reference, its cells coloured by how well they agree."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.overlay.legend import TEXT_SIZE, Entry, legend_rows, mark_sample, ridge_sample
from fpmatch.drawing.overlay.marks import BESIDE_PAIRED, described, examiner_marks, marks
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.fonts import text_width
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
from fpmatch.matching.pipeline.ridge_map import IMPOSTOR_MEAN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.marks import ExaminerMark
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.pipeline.ridge_map import RidgeMap
    from fpmatch.matching.verification import Verification

_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown
_INK: Final[palette.Colour] = (70, 72, 76)
_STEPS: Final = 64  # of the scale of colours
_AGREEMENTS: Final = (
    *((0.0, "0"), (IMPOSTOR_MEAN, f"{IMPOSTOR_MEAN:.2g}: mean of different fingers")),
    *((0.6, "0.6"), (0.8, "0.8"), (1.0, "1: the ridges coincide")),
)

# From low to high, along blue and yellow and from dark to light: pale relatives of cividis (Nuñez,
# Anderton, Renslow, PLOS ONE 13(7), 2018), so that ridges stay legible on them.
AGREEMENT: Final[tuple[Colour, ...]] = (
    *((84, 118, 178), (136, 158, 192), (196, 198, 198)),
    *((228, 218, 158), (255, 234, 96)),
)


def ridge_page(
    reference: Print, verification: Verification, ridges: RidgeMap, own: Sequence[ExaminerMark] = ()
) -> Scene:
    """Compose the page of the reference with the cells of `ridges` and an examiner's marks."""
    t = reference.template
    shown = np.vstack([reference.box.corners, ridges.corners.reshape(-1, 2)])
    view = bounds(moved(np.eye(3), shown)).grown(_BORDER_PX)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)

    def panel(place: Box) -> list[Item]:
        to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
        ink = ink_of(reference, to_page, _INK, "reference ridges")
        j = verification.pairs.reshape(-1, 2)[:, 1].tolist()
        titles = {
            b: f"pair {n}: reference {described(t.minutiae, b)}" for n, b in enumerate(j, start=1)
        }
        transform = verification.transform
        there = None if transform is None else to_page @ of_transform(transform)
        inside: tuple[Item, ...] = (
            *_cells(ridges, to_page),
            *((ink,) if ink else ()),
            *marks(t.minutiae, j, to_page, BESIDE_PAIRED["reference"], place, titles),
            *examiner_marks(own, "reference", to_page, there, place),
        )
        return [Group(inside, place, "ridge agreement"), frame(place)]

    size = (round(view.width * zoom), round(view.height * zoom))
    area = 0.0 if verification.compared is None else verification.compared.ridge_area_mm2
    legend = partial(_legend, mean=ridges.mean, area_mm2=area)
    return page(verification, size, panel, legend)


def _cells(ridges: RidgeMap, to_page: NDArray[np.float64]) -> list[Item]:
    values = ridges.correlation[ridges.compared].tolist()
    items: list[Item] = []
    for corner, value in zip(ridges.corners, values, strict=True):
        colour = agreement(value)
        points = tuple(moved(to_page, corner))
        title = f"ridge agreement {value:.2f}"
        items.append(Path(points, Pen(colour, colour), True, "cell", title))
    return items


def _legend(width: float, top: float, *, mean: float, area_mm2: float) -> tuple[list[Item], float]:
    """Compose the scale of colours of the ridge agreement; returns its items and its height."""
    bar = Box(MARGIN + 70, top + 30, width - 2 * MARGIN - 140, 16)
    steps = [bar.x + bar.width * k / _STEPS for k in range(_STEPS + 1)]
    items: list[Item] = []
    for k, (left, right) in enumerate(pairwise(steps)):
        colour = agreement((k + 0.5) / _STEPS)
        box = Box(left, bar.y, right - left, bar.height)
        items.append(Path(box.corners, Pen(colour, colour), closed=True))
    items.append(Path(bar.corners, Pen(palette.TEXT_MUTED), closed=True))
    above = f"agreement of the ridges of this comparison: {mean:.2f} on {area_mm2:.0f} mm²"
    items += _tick(bar, mean, above, bar.y - 12, palette.TEXT)
    for value, words in _AGREEMENTS:
        items += _tick(bar, value, words, bar.bottom + 22, palette.TEXT_MUTED)
    entries: list[Entry] = [
        ("reference ridges", partial(ridge_sample, ink=palette.NEUTRAL_INK)),
        ("paired minutia of reference", partial(mark_sample, style=BESIDE_PAIRED["reference"])),
        ("not compared", partial(_not_compared)),
    ]
    rows, height = legend_rows(entries, width, bar.bottom + 32)
    return [*items, *rows], bar.bottom + 32 + height - top


def _not_compared(x: float, y: float) -> list[Item]:
    box = Box(x + 8, y - 8, 16, 16)
    return [Path(box.corners, Pen(palette.PANEL_EDGE, palette.PAPER), closed=True)]


def _tick(bar: Box, value: float, words: str, baseline: float, colour: Colour) -> list[Item]:
    """Mark a value of a scale of 0 to 1, with words above or below it."""
    x = bar.x + bar.width * min(max(value, 0.0), 1.0)
    half = text_width(words, TEXT_SIZE) / 2
    middle = min(max(x, MARGIN + half), bar.right + 70 - half)
    ends = (bar.y - 8, bar.bottom) if baseline < bar.y else (bar.y, bar.bottom + 6)
    line = Path(((x, ends[0]), (x, ends[1])), Pen(palette.TEXT, width=2.0))
    return [line, Text(middle, baseline, words, TEXT_SIZE, colour, "middle")]


def agreement(value: float) -> Colour:
    """Return the colour of an agreement of ridges: the lowest for 0 and less, the highest for 1."""
    place = min(max(value, 0.0), 1.0) * (len(AGREEMENT) - 1)
    k = min(int(place), len(AGREEMENT) - 2)
    low, high, share = AGREEMENT[k], AGREEMENT[k + 1], place - k
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue

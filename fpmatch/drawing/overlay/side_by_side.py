"""The page of two prints side by side: each as it was taken, the pairs numbered."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.caption import MARGIN, header
from fpmatch.drawing.overlay.marks import (
    BESIDE_PAIRED,
    BESIDE_UNPAIRED,
    KIND_SAMPLES,
    mark_sample,
    marks,
    ridge_sample,
)
from fpmatch.drawing.overlay.page import comfortable_zoom, frame, page
from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.ink import ink_of
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Item,
    Path,
    Pen,
    Point,
    Scene,
    Text,
    directions,
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

    from fpmatch.drawing.scene.items import Matrix
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.verification import Verification
    from fpmatch.templates.minutiae import Template

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


def side_by_side_page(
    images: tuple[NDArray[np.uint8], NDArray[np.uint8]], verification: Verification
) -> Scene:
    """Compose the page of `images`, probe and reference, at the same resolution.

    The pairs of `verification` are numbered in their order, from 1.
    """
    v, names = verification, ("probe", "reference")
    prints, indices = (v.probe, v.reference), v.pairs.reshape(-1, 2).T.tolist()
    sizes = [(t.width * STANDARD_DPI / t.dpi, t.height * STANDARD_DPI / t.dpi) for t in prints]
    zoom = comfortable_zoom(max(map(max, sizes)), _COMFORTABLE_SIDE)
    widths, heights = (
        [max(round(zoom * size[k] + 2 * _BORDER), _LEAST_SIDE) for size in sizes] for k in range(2)
    )
    size = (widths[0] + MARGIN + widths[1], max(heights) + _TITLE_HEIGHT)
    caption, place = header(v, size)
    panels = [
        Box(x, place.y + _TITLE_HEIGHT, w, max(heights))
        for x, w in zip((place.x, place.right - widths[1]), widths, strict=True)
    ]
    ours, theirs = (_placed(t, zoom, box) for t, box in zip(prints, panels, strict=True))
    sides = list(zip(names, prints, (ours, theirs), panels, indices, strict=True))
    starts, ends = (moved(matrix, t.minutiae.xy) for _, t, matrix, *_ in sides)
    items: list[Item] = []
    for (name, t, matrix, panel, _), image in zip(sides, images, strict=True):
        minutiae = count(len(t.minutiae), "minutia", "minutiae")
        title = f"{name.title()}: {minutiae}, {t.width} x {t.height} px, {t.dpi:g} dpi"
        colour = BESIDE_PAIRED[name].pen.stroke or TEXT
        ink = ink_of(image, t, matrix, NEUTRAL_INK, f"{name} ridges")
        items += [
            Text(panel.x, panel.y - 9, title, _TITLE_SIZE, colour),
            Group(ink, panel, name),
            frame(panel),
        ]
    items += [
        Path((starts[a], ends[b]), _LINK_PEN, role="pair", title=f"pair {n}")
        for n, (a, b) in enumerate(zip(*indices, strict=True), start=1)
    ]
    for side in sides:
        items += _minutiae(*side)
    entries = [ridge_sample("ridges", NEUTRAL_INK)]
    if len(v.pairs):
        entries.append(mark_sample("paired, numbered, joined", BESIDE_PAIRED["probe"]))
        entries.append(mark_sample("unpaired", BESIDE_UNPAIRED["probe"]))
    onto = None if v.transform is None else of_transform(v.transform)
    placed = (
        ("probe", ours, None if onto is None else ours @ np.linalg.inv(onto), panels[0]),
        ("reference", theirs, None if onto is None else theirs @ onto, panels[1]),
    )
    return page(v, caption, items, [*entries, *KIND_SAMPLES], place.bottom, placed)


def _placed(t: Template, zoom: float, panel: Box) -> Matrix:
    """Return the matrix that centres a print in its panel."""
    middle = (panel.x + panel.width / 2, panel.y + panel.height / 2)
    return zoomed(zoom * STANDARD_DPI / t.dpi, ((t.width - 1) / 2, (t.height - 1) / 2), middle)


def _minutiae(
    side: str, template: Template, matrix: Matrix, panel: Box, paired: list[int]
) -> list[Item]:
    """Draw the minutiae of one print, and the numbers of the paired ones."""
    minutiae, style = template.minutiae, BESIDE_PAIRED[side]
    places, ways = moved(matrix, minutiae.xy), directions(matrix, minutiae.angle)
    obstacles = [Box(*place, 0, 0).grown(_MARK_REACH) for place in places]
    marked = [(places[i], ways[i]) for i in paired]
    rest = BESIDE_UNPAIRED[side] if paired else style
    return [
        *marks(minutiae, sorted({*range(len(minutiae))}.difference(paired)), matrix, rest),
        *marks(minutiae, paired, matrix, style),
        *place_numbers(marked, obstacles, panel, style.pen.stroke or TEXT),
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

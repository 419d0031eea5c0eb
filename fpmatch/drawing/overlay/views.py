"""The three pages: prints superposed, their ridge agreement, and prints side by side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.page import (
    BESIDE_PAIRED,
    BESIDE_UNPAIRED,
    EDGES,
    KIND_SAMPLES,
    LEGEND_SIZE,
    MARGIN,
    PAIR_PEN,
    PAIRED,
    RIDGE_SAMPLES,
    SAMPLE_WIDTH,
    UNPAIRED,
    comfortable_zoom,
    ending_sample,
    header,
    mark,
    marks,
    page,
    panel_for,
)
from fpmatch.drawing.scene import palette
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
    text_width,
    zoomed,
)
from fpmatch.matching.constants import IMPOSTOR_RIDGES
from fpmatch.printable import count
from fpmatch.templates.minutiae import STANDARD_DPI, MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.page import Entry
    from fpmatch.drawing.scene.items import Matrix
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.matching.verify import Verification
    from fpmatch.pointset.geometry.similarity import Similarity
    from fpmatch.templates.minutiae import Template

_REACH: Final = 0.75  # of the reference's longer side: how far beyond it the probe is shown
_SUPERPOSED_LEGEND: Final[tuple[Entry, ...]] = (
    ("reference ridges", RIDGE_SAMPLES[palette.REFERENCE_INK]),
    ("probe ridges, moved", RIDGE_SAMPLES[palette.PROBE_INK]),
    ("both together", RIDGE_SAMPLES[palette.BOTH_INKS]),
    (
        "paired minutiae",
        (
            *mark((9.0, 3.0), (1.0, 0.0), MinutiaKind.ENDING, PAIRED["reference"]),
            *mark((17.0, -3.0), (1.0, 0.0), MinutiaKind.ENDING, PAIRED["probe"]),
            Path(((9.0, 3.0), (17.0, -3.0)), PAIR_PEN),
        ),
    ),
    ("unpaired, of reference", ending_sample(UNPAIRED["reference"])),
    ("unpaired, of probe", ending_sample(UNPAIRED["probe"])),
    *KIND_SAMPLES,
    ("edge of probe", (Path(((0.0, 0.0), (SAMPLE_WIDTH, 0.0)), EDGES["probe"]),)),
    ("edge of reference", (Path(((0.0, 0.0), (SAMPLE_WIDTH, 0.0)), EDGES["reference"]),)),
)

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
_RIDGES_LEGEND: Final[tuple[Entry, ...]] = (
    ("reference ridges", RIDGE_SAMPLES[palette.NEUTRAL_INK]),
    ("paired minutia of reference", ending_sample(BESIDE_PAIRED["reference"])),
    ("not compared", (_NOT_COMPARED,)),
)

_COMFORTABLE_SIDE: Final = 760.0  # page pixels of each print
_LEAST_SIDE: Final = 360.0
_BORDER: Final = 8.0
_TITLE_HEIGHT: Final = 26.0
_TITLE_SIZE: Final = 16.0
_LINK_PEN: Final = Pen(palette.TEXT, width=1.0, opacity=0.25)
_MARK_REACH: Final = 7.0  # page pixels around a minutia that numbers avoid
_SIZE, _HALO = 14.0, 2.0  # of numbers
_CAP_HEIGHT: Final = 0.72  # of the size: height of digits
_DISTANCE: Final = 10.0  # from the mark's centre to the nearest edge of its number
_PLACES: Final = 16
_TICK_COST: Final = 6.0  # page pixels of overlap that equal a place in the tick's direction
_OUTSIDE_COST: Final = 4.0  # of leaving the panel, in costs of covering something


def superposed_page(
    images: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    verification: Verification,
    transform: Similarity,
) -> Scene:
    """Compose the page of `images`, probe and reference; `transform` maps probe to reference."""
    v, onto = verification, transform.matrix
    own = Box(-0.5, -0.5, v.reference.width, v.reference.height)
    outline = moved(onto, Box(-0.5, -0.5, v.probe.width, v.probe.height).corners)
    limit = own.grown(_REACH * max(own.width, own.height))
    near = np.clip(outline, (limit.x, limit.y), (limit.right, limit.bottom))
    caption, place, to_page = panel_for(v, np.vstack([own.corners, near]))
    moving = to_page @ np.vstack([onto, (0.0, 0.0, 1.0)])
    inside: tuple[Item, ...] = (
        *ink_of(images[1], v.reference, to_page, palette.REFERENCE_INK, "reference ridges"),
        *ink_of(images[0], v.probe, moving, palette.PROBE_INK, "probe ridges"),
        *(
            Path(tuple(moved(to_page, edge)), EDGES[side], closed=True, role=f"{side} edge")
            for side, edge in (("reference", own.corners), ("probe", outline))
        ),
        *minutiae_and_pairs(v, moving, to_page),
    )
    panel = [Group(inside, place, "prints")]
    return page(v, caption, panel, _SUPERPOSED_LEGEND, place.bottom, place)


def minutiae_and_pairs(verification: Verification, moving: Matrix, to_page: Matrix) -> list[Item]:
    """Draw the unpaired minutiae, over them the pairs: reference, link, probe.

    `moving` maps pixels of the probe to the page, `to_page` pixels of the reference.
    """
    ours, theirs = verification.probe.minutiae, verification.reference.minutiae
    i, j = verification.pairs.reshape(-1, 2).T.tolist()
    starts, ends = moved(moving, ours.xy), moved(to_page, theirs.xy)
    alone = [sorted({*range(len(m))}.difference(k)) for m, k in ((theirs, j), (ours, i))]
    return [
        *marks(theirs, alone[0], to_page, UNPAIRED["reference"]),
        *marks(ours, alone[1], moving, UNPAIRED["probe"]),
        *marks(theirs, j, to_page, PAIRED["reference"]),
        *(Path((starts[a], ends[b]), PAIR_PEN, role="pair") for a, b in zip(i, j, strict=True)),
        *marks(ours, i, moving, PAIRED["probe"]),
    ]


def ridge_page(image: NDArray[np.uint8], verification: Verification, ridges: RidgeMap) -> Scene:
    """Compose the page of the `image` of the reference with the cells of `ridges`."""
    v, t = verification, verification.reference
    own = Box(-0.5, -0.5, t.width, t.height)
    squares = _squares(ridges)
    shown = np.vstack([own.corners, squares.reshape(-1, 2)])
    caption, place, to_page = panel_for(v, shown)
    colours = map(agreement, ridges.correlation.tolist())
    pens = [Pen(colour, colour) for colour in colours]
    j = v.pairs.reshape(-1, 2)[:, 1].tolist()
    inside: tuple[Item, ...] = (
        *(
            Path(tuple(moved(to_page, corners)), pen, True, "cell")
            for corners, pen in zip(squares, pens, strict=True)
        ),
        *ink_of(image, t, to_page, _INK, "reference ridges"),
        *marks(t.minutiae, j, to_page, BESIDE_PAIRED["reference"]),
    )
    area = 0.0 if v.compared is None else v.compared.ridge_area_mm2
    scale, bottom = _scale(caption.clip.width, place.bottom + 10, ridges.mean, area)
    panel = [Group(inside, place, "ridge agreement"), *scale]
    return page(v, caption, panel, _RIDGES_LEGEND, bottom, place)


def _squares(ridges: RidgeMap) -> NDArray[np.float64]:
    """Return the corners of the cells in pixels of the reference, clockwise, shape (K, 4, 2)."""
    angle, half = math.radians(ridges.rotation_deg), 0.5 * ridges.cell_px
    across = half * np.array([math.cos(angle), math.sin(angle)])
    down = half * np.array([-math.sin(angle), math.cos(angle)])
    square = np.array([-across - down, across - down, across + down, down - across])
    return np.asarray(ridges.xy[:, None, :] + square)


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
    ours, theirs = (
        zoomed(
            zoom * STANDARD_DPI / t.dpi,
            ((t.width - 1) / 2, (t.height - 1) / 2),
            (panel.x + panel.width / 2, panel.y + panel.height / 2),
        )
        for t, panel in zip(prints, panels, strict=True)
    )
    sides = list(zip(names, prints, (ours, theirs), panels, indices, strict=True))
    starts, ends = (moved(matrix, t.minutiae.xy) for _, t, matrix, *_ in sides)
    items: list[Item] = []
    for (name, t, matrix, panel, _), image in zip(sides, images, strict=True):
        minutiae = count(len(t.minutiae), "minutia", "minutiae")
        title = f"{name.title()}: {minutiae}, {t.width} x {t.height} px, {t.dpi:g} dpi"
        colour = BESIDE_PAIRED[name].pen.stroke or palette.TEXT
        ink = ink_of(image, t, matrix, palette.NEUTRAL_INK, f"{name} ridges")
        items += [
            Text(panel.x, panel.y - 9, title, _TITLE_SIZE, colour),
            Group(ink, panel, name),
        ]
    items += [
        Path((starts[a], ends[b]), _LINK_PEN, role="pair") for a, b in zip(*indices, strict=True)
    ]
    for side in sides:
        items += _minutiae(*side)
    entries: list[Entry] = [("ridges", RIDGE_SAMPLES[palette.NEUTRAL_INK])]
    if len(v.pairs):
        entries.append(("paired, numbered, joined", ending_sample(BESIDE_PAIRED["probe"])))
        entries.append(("unpaired", ending_sample(BESIDE_UNPAIRED["probe"])))
    entries += KIND_SAMPLES
    scene = page(v, caption, items, entries, place.bottom, *panels)
    return scene._replace(placed=((ours, panels[0]), (theirs, panels[1])))


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
        *place_numbers(marked, obstacles, panel, style.pen.stroke or palette.TEXT),
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

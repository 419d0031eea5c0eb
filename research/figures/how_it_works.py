"""The figure "how it works": two prints at each step of the matcher "unit-circle"."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

import fpmatch
from fpmatch.drawing.overlay.page import FRAME_PEN, MarkStyle, marks
from fpmatch.drawing.overlay.views import minutiae_and_pairs
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.ink import ink_of, print_picture
from fpmatch.drawing.scene.items import (
    Box,
    Circle,
    Group,
    Ink,
    Pen,
    Scene,
    Text,
    bounds,
    moved,
    wrapped,
    zoomed,
)
from fpmatch.drawing.scene.items import Path as Line
from fpmatch.drawing.scene.raster import paint
from fpmatch.errors import FpmatchError
from fpmatch.lab.explain.default import DefaultMethod
from fpmatch.lab.explain.pictures import clearest
from fpmatch.prints.pair import PairOptions, compare_pair
from fpmatch.prints.reading import GivenPrint

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Item, Point
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.lab.explain.pictures import Ring


# Page pixels: the page is shown at about half its size.
MARGIN, GAP, ROW_GAP = 22.0, 44.0, 18.0
PANEL_WIDTH, CIRCLE_WIDTH, OVERLAY_WIDTH = 290.0, 330.0, 520.0
TITLE_SIZE, CAPTION_SIZE, LABEL_SIZE = 27.0, 22.0, 21.0
LEADING = 28.0
PRINT_MARGIN_PX = 6.0  # of a print, around what has ridges
CIRCLE_RADIUS = 108.0
DOT = 9.0

TITLES: Final = (
    "1  Two prints",
    "2  Minutiae",
    "3  Mesh of pairs",
    "4  On the unit circle",
    "5  Overlay",
)
CAPTIONS: Final = (
    "Of one finger, turned and stretched.",
    "Ridges thinned. Circle: a ridge ends, square: it forks; tick: direction.",
    "Minutiae with similar neighbours are paired, and the pairs triangulated. In colour: a ring.",
    "The ring, spaced by the lengths of its sides. Pale blue: the probe's again; the places agree.",
    "Rings predict where other minutiae lie; one transform is fitted to all pairs. Orange: "
    "reference, blue: probe, dark: ridges of both.",
)


MARKS: Final = {"P": palette.PROBE_MARK, "Q": palette.REFERENCE_MARK}
INKS: Final = {"P": palette.PROBE_INK, "Q": palette.REFERENCE_INK}
GREY: Final[Colour] = (150, 154, 160)
SKELETON_INK: Final[Colour] = (170, 173, 178)
FOLLOWED: Final = Pen(palette.TEXT, palette.PAPER, width=3.0)  # the minutia, and its image


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One print, its skeleton and its colours."""

    name: str
    mark: Colour
    ink: Colour
    given: GivenPrint
    skeleton: NDArray[np.bool_]
    field: fpmatch.RidgeField

    @classmethod
    def of(cls, name: str, letter: str, path: Path) -> Side:
        """Extract a print, keeping its skeleton."""
        image = fpmatch.read_image(path)
        assessed = fpmatch.assess(image)
        template = assessed.template
        if template.field is None:
            raise FpmatchError(f"{path}: no ridges found")
        skeleton = assessed.stages()["skeleton"] > 0
        given = GivenPrint(name, template, image)
        return cls(name, MARKS[letter], INKS[letter], given, skeleton, template.field)

    @property
    def template(self) -> fpmatch.Template:
        """Its template."""
        return self.given.template

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """Its image."""
        return print_picture(self.given)

    def view(self) -> Box:
        """Return the part of the image that has ridges, in its pixels."""
        return self._bounds_of_ridges(np.eye(3)).grown(PRINT_MARGIN_PX)

    def view_with(self, other: Side, transform: fpmatch.Similarity) -> Box:
        """Return the part that has ridges of this print, or of `other` once it is moved."""
        own, their = self.view(), other._bounds_of_ridges(transform.matrix)
        return bounds([*own.corners, *their.corners])

    def _bounds_of_ridges(self, matrix: NDArray[np.float64]) -> Box:
        """Return the smallest box around the cells with ridges, moved by `matrix`."""
        rows, columns = np.nonzero(self.field.mask)
        cells = self.field.step * (np.column_stack([columns, rows]) + 0.5)
        return bounds(moved(matrix, cells)).grown(self.field.step / 2)


def followed(m: DefaultMethod) -> Ring:
    """Return the ring in the mesh of pairs that is easiest to read."""
    chosen = clearest(m.rings, m.candidates.similarity[m.paired].tolist())
    ring = None if chosen is None else m.rings[chosen]
    if ring is None:
        raise FpmatchError("no pair has a ring; take other prints")
    return ring


def centred(view: Box, size: tuple[float, float]) -> Box:
    """Return a box of `size` about the middle of `view`."""
    width, height = size
    x, y = view.x + (view.width - width) / 2, view.y + (view.height - height) / 2
    return Box(x, y, width, height)


def into(place: Box, view: Box) -> NDArray[np.float64]:
    """Return the matrix that takes `view`, in a print's pixels, to `place` on the page."""
    return zoomed(place.width / view.width, (view.x, view.y), (place.x, place.y))


def arrow(start: Point, direction: Point, length: float, pen: Pen, head: float) -> list[Item]:
    """Draw an arrow of `length` from `start` along the unit vector `direction`."""
    (x, y), (dx, dy) = start, direction
    tip, neck = (x + length * dx, y + length * dy), length - head
    base = (x + neck * dx, y + neck * dy)
    half = head / 2
    corners = (
        tip,
        (base[0] - half * dy, base[1] + half * dx),
        (base[0] + half * dy, base[1] - half * dx),
    )
    return [Line((start, base), pen), Line(corners, pen._replace(fill=pen.stroke), closed=True)]


def panel(place: Box, items: list[Item]) -> list[Item]:
    """Draw `items` inside `place`, with a frame around it."""
    frame = Line(place.grown(0.5).corners, FRAME_PEN, closed=True)
    return [Group(tuple(items), place), frame]


def print_panel(side: Side, place: Box, view: Box) -> list[Item]:
    """Draw the image of the print."""
    ink = Ink(np.invert(side.pixels), palette.TEXT, into(place, view))
    label = Text(place.x + 12, place.y + 30, side.name, CAPTION_SIZE, side.mark, bold=0.5, halo=4.0)
    return panel(place, [ink, label])


def ridge_panel(side: Side, place: Box, view: Box) -> list[Item]:
    """Draw the skeleton, and the minutiae on it with kind and direction."""
    matrix = into(place, view)
    thick = np.asarray(cv2.dilate(side.skeleton.astype(np.uint8) * 255, np.ones((2, 2))), np.uint8)
    every = range(len(side.template.minutiae))
    drawn = marks(side.template.minutiae, every, matrix, _small(side.mark))
    return panel(place, [Ink(thick, SKELETON_INK, matrix), *drawn])


def _small(colour: Colour) -> MarkStyle:
    return MarkStyle(Pen(colour, width=2.4, halo=1.6), 5.0, 10.0, "paired")


def mesh_panel(side: Side, place: Box, view: Box, m: DefaultMethod, which: int) -> list[Item]:
    """Draw the mesh of pairs, and in it the ring of the pair that is followed, numbered."""
    matrix, ring, own = into(place, view), followed(m), m.sides[which]
    ends = own.shown(ring.edges[which].ravel()).reshape(-1, 2, 2)
    lines = [tuple(moved(matrix, two)) for two in ends]
    points = moved(matrix, own.shown(ring.points[which]))
    (centre,) = moved(matrix, own.shown(np.array([ring.centres[which]])))
    strong = Pen(side.mark, width=3.4)
    items: list[Item] = [Line(line, Pen(GREY, width=1.8)) for line in lines]
    items.append(Line(tuple(points), Pen(fill=side.ink, opacity=0.3), closed=True))
    items += [Line((centre, point), strong._replace(width=2.2)) for point in points]
    items.append(Line(tuple(points), strong, closed=True))
    paired = own.z[m.as_pq(*m.paired)[which]]
    spots = moved(matrix, own.shown(paired))
    items += [Circle(spot, 3.6, Pen(fill=palette.NEUTRAL_INK)) for spot in spots]
    middle = np.mean(points, axis=0)
    for n, point in enumerate(points, start=1):
        items.append(Circle(point, 5.5, Pen(fill=side.mark)))
        items.append(_number(n, point, point - middle, 20.0))
    return panel(place, [*items, Circle(centre, 7.0, FOLLOWED)])


def _number(n: int, at: Point, away: NDArray[Any], distance: float) -> Text:
    """Write a neighbour's number beside it, on the side that points `away`."""
    dx, dy = np.asarray(away) / np.hypot(*away) * distance
    x, y = at[0] + float(dx), at[1] + float(dy) + LABEL_SIZE * 0.36
    return Text(x, y, str(n), LABEL_SIZE, palette.TEXT, "middle", bold=0.5, halo=3.0)


def circle_panel(side: Side, place: Box, m: DefaultMethod, which: int) -> list[Item]:
    """Draw the ring on the unit circle, its points numbered; in the reference's the probe's too."""
    ring = followed(m)
    centre = (place.x + place.width / 2, place.y + place.height / 2)
    spots = _on_page(ring.angles[which] + (0.0 if which else ring.turn), centre)
    items: list[Item] = [
        Circle(centre, CIRCLE_RADIUS, Pen(palette.NEUTRAL_INK, palette.BAND, width=2.0)),
        Line(tuple(spots), Pen(side.mark, width=2.6), closed=True),
    ]
    for n, spot in enumerate(spots, start=1):
        items.append(Circle(spot, DOT, Pen(palette.PAPER, side.mark, width=1.5)))
        items.append(_number(n, spot, np.subtract(spot, centre), DOT + LABEL_SIZE))
    probes = _on_page(ring.angles[0] + ring.turn, centre) if which else []
    items += [Circle(spot, DOT + 2, Pen(palette.PROBE_INK, width=3.0)) for spot in probes]
    return panel(place, items)


def _on_page(angles: NDArray[np.float64], centre: Point) -> list[Point]:
    """Return places on the unit circle, y up, as places on the page."""
    x, y = centre
    spots = CIRCLE_RADIUS * np.column_stack([np.cos(angles), -np.sin(angles)]) + (x, y)
    return [(u, v) for u, v in spots.tolist()]


def overlay_panel(
    probe: Side, reference: Side, found: fpmatch.Verification, place: Box
) -> list[Item]:
    """Draw the probe, moved, over the reference, and the pairs."""
    if found.transform is None:
        raise FpmatchError(f"{probe.name} and {reference.name} do not match")
    view = reference.view_with(probe, found.transform)
    to_page = zoomed(
        min(place.width / view.width, place.height / view.height),
        (view.x + view.width / 2, view.y + view.height / 2),
        (place.x + place.width / 2, place.y + place.height / 2),
    )
    moving = np.asarray(to_page @ np.vstack([found.transform.matrix, (0.0, 0.0, 1.0)]))
    ridges = [
        *ink_of(reference.pixels, reference.template, to_page, palette.REFERENCE_INK, "reference"),
        *ink_of(probe.pixels, probe.template, moving, palette.PROBE_INK, "probe"),
    ]
    return panel(place, [*ridges, *minutiae_and_pairs(found, moving, to_page)])


def how_it_works(probe_path: Path, reference_path: Path) -> NDArray[np.uint8]:
    """Draw the whole method, from two prints on the left to their overlay on the right."""
    probe = Side.of("probe", "P", probe_path)
    reference = Side.of("reference", "Q", reference_path)
    pair = compare_pair(probe.given, reference.given, PairOptions())
    m = DefaultMethod.of(pair.probe, pair.reference)

    views = probe.view(), reference.view()
    size = max(v.width for v in views), max(v.height for v in views)
    height = PANEL_WIDTH * size[1] / size[0]
    top = MARGIN + TITLE_SIZE + 14
    widths = (PANEL_WIDTH, PANEL_WIDTH, PANEL_WIDTH, CIRCLE_WIDTH, OVERLAY_WIDTH)
    lefts = [MARGIN + sum(widths[:n]) + n * GAP for n in range(len(widths))]
    bottom = top + 2 * height + ROW_GAP

    items: list[Item] = []
    for which, (side, y) in enumerate(((probe, top), (reference, top + height + ROW_GAP))):
        view = centred(side.view(), size)
        places = [Box(x, y, w, height) for x, w in zip(lefts, widths, strict=True)]
        items += print_panel(side, places[0], view)
        items += ridge_panel(side, places[1], view)
        items += mesh_panel(side, places[2], view, m, which)
        items += circle_panel(side, places[3], m, which)
    place = Box(lefts[4], top, OVERLAY_WIDTH, bottom - top)
    items += overlay_panel(probe, reference, pair.verification, place)
    foot = bottom
    for x, width, title, caption in zip(lefts, widths, TITLES, CAPTIONS, strict=True):
        items.append(Text(x, MARGIN + TITLE_SIZE, title, TITLE_SIZE, palette.TEXT, bold=0.4))
        for n, line in enumerate(wrapped(caption, CAPTION_SIZE, width), start=1):
            items.append(Text(x, bottom + 8 + n * LEADING, line, CAPTION_SIZE, palette.TEXT_MUTED))
            foot = max(foot, bottom + 8 + n * LEADING)
    for x in lefts[1:]:
        start = (x - GAP + 8, (top + bottom) / 2)
        items += arrow(start, (1.0, 0.0), GAP - 16, Pen(palette.TEXT_MUTED, width=4.0), 16.0)
    page_width = lefts[-1] + widths[-1] + MARGIN
    return paint(Scene(math.ceil(page_width), math.ceil(foot + MARGIN), tuple(items)))

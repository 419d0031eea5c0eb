"""The figure "how it works": two prints at each step of the matcher "unit-circle"."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

import fpmatch
from fpmatch.drawing.overlay.marks import PAIRED, marks
from fpmatch.drawing.overlay.page import Print, frame
from fpmatch.drawing.overlay.superposed import inks, minutiae_and_pairs
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.fonts import wrapped
from fpmatch.drawing.scene.items import (
    Box,
    Circle,
    Group,
    Ink,
    Pen,
    Scene,
    Text,
    bounds,
    direction_on_page,
    moved,
    of_transform,
    zoomed,
)
from fpmatch.drawing.scene.items import Path as Line
from fpmatch.drawing.scene.raster import paint
from fpmatch.errors import FpmatchError
from fpmatch.lab.paper_figures.marks import MESH, TINTS, Tint
from fpmatch.matching.prints.prepare import prepare
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.paper.parametrize import UnitCircle, parametrize

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.marks import MarkStyle
    from fpmatch.drawing.scene.items import Item, Point
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.prints.prepare import PreparedTemplate
    from fpmatch.pointset.delaunay.triangulate import Triangulation


# Page pixels: the page is shown at about half its size.
MARGIN, GAP, ROW_GAP = 22.0, 44.0, 18.0
PANEL_WIDTH, CIRCLE_WIDTH, OVERLAY_WIDTH = 290.0, 330.0, 520.0
TITLE_SIZE, CAPTION_SIZE, LABEL_SIZE = 27.0, 22.0, 21.0
LEADING = 28.0
PRINT_MARGIN_PX = 6.0  # of a print, around what has ridges
CIRCLE_RADIUS = 108.0
LARGEST_DOT = 32.0  # radius at a weight of 1; the area is proportional to the weight
FEWEST_NEIGHBOURS: Final = 6  # of the minutia that is followed

TITLES: Final = (
    "1  Two prints",
    "2  Minutiae",
    "3  Triangulation",
    "4  On the unit circle",
    "5  Overlay",
)
CAPTIONS: Final = (
    "Of one finger, turned and stretched.",
    "Ridges thinned. Circle: a ridge ends, square: it forks; tick: direction.",
    "Delaunay's. In colour: one minutia, its direction and its ring of neighbours.",
    "Ring spaced by its sides' lengths, from point 1 on. Dot size: weight of a neighbour. "
    "Pale blue: the probe's again.",
    "Rings drawn through paired minutiae predict where the others lie; one transform is fitted to "
    "all pairs. Orange: reference, blue: probe, dark: ridges of both.",
)


SKELETON_INK: Final[Colour] = (170, 173, 178)
FOLLOWED: Final = Pen(palette.TEXT, palette.PAPER, width=3.0)  # the minutia, and its image


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One print and the results of the matcher's steps, of all its minutiae in order."""

    name: str
    tint: Tint
    pixels: NDArray[np.uint8]
    skeleton: NDArray[np.bool_]
    template: fpmatch.Template
    field: fpmatch.RidgeField
    prepared: PreparedTemplate
    mesh: Triangulation

    @classmethod
    def of(cls, name: str, tint: Tint, path: Path) -> Side:
        """Extract a print, keeping its skeleton, and triangulate its minutiae."""
        image, recorder = fpmatch.read_image(path), fpmatch.StageRecorder()
        template = fpmatch.extract(image, recorder=recorder)
        if template.field is None:
            raise FpmatchError(f"{path}: no ridges found")
        prepared = prepare(template)
        mesh = triangulate(np.ascontiguousarray(prepared.points[:2].T))
        skeleton = recorder.stages["skeleton"] > 0
        return cls(name, tint, image.pixels, skeleton, template, template.field, prepared, mesh)

    def ring(self, i: int) -> list[int]:
        """Return the one-ring of minutia `i`, counter-clockwise; none where it is not closed."""
        return self.mesh.one_ring(i).tolist() if self.mesh.interior[i] else []

    def circle(self, i: int, ring: list[int]) -> UnitCircle:
        """Map minutia `i` and its ring, y up, to the unit circle (eq. 3 and 4)."""
        return parametrize(self.mesh.points[ring], self.mesh.points[i])

    def view(self) -> Box:
        """Return the part of the image that has ridges, in its pixels."""
        return self._bounds_of_ridges(np.eye(3)).grown(PRINT_MARGIN_PX)

    def view_with(self, other: Side, transform: fpmatch.Similarity) -> Box:
        """Return the part that has ridges of this print, or of `other` once it is moved."""
        own, their = self.view(), other._bounds_of_ridges(of_transform(transform))
        return bounds([*own.corners, *their.corners])

    def _bounds_of_ridges(self, matrix: NDArray[np.float64]) -> Box:
        """Return the smallest box around the cells with ridges, moved by `matrix`."""
        rows, columns = np.nonzero(self.field.mask)
        cells = self.field.step * (np.column_stack([columns, rows]) + 0.5)
        return bounds(moved(matrix, cells)).grown(self.field.step / 2)


def followed_pair(probe: Side, reference: Side, pairs: NDArray[np.int32]) -> tuple[int, int]:
    """Return the paired minutiae whose rings agree point by point and are easiest to read."""
    partner = {int(i): int(j) for i, j in pairs}

    def agrees(i: int, j: int) -> bool:
        partners = [partner.get(k, -1) for k in probe.ring(i)]
        ring = reference.ring(j)
        turned = (ring[n:] + ring[:n] for n in range(len(ring)))
        return len(ring) >= FEWEST_NEIGHBOURS and partners in turned

    def clarity(i: int) -> tuple[bool, float]:
        points, ring = probe.prepared.points[:2], probe.ring(i)
        nearest = np.hypot(*(points[:, ring] - points[:, [i]])).min()
        away_from_edge = bool(probe.mesh.interior[ring].all())
        return away_from_edge, float(nearest * np.ptp(probe.circle(i, ring).weights))

    agreeing = [pair for pair in sorted(partner.items()) if agrees(*pair)]
    if not agreeing:
        raise FpmatchError("no two paired minutiae have the same ring; take other prints")
    return max(agreeing, key=lambda pair: clarity(pair[0]))


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
    return [Line((start, base), pen), Line(corners, replace(pen, fill=pen.stroke), closed=True)]


def panel(place: Box, items: list[Item]) -> list[Item]:
    """Draw `items` inside `place`, with a frame around it."""
    return [Group(tuple(items), place), frame(place)]


def print_panel(side: Side, place: Box, view: Box) -> list[Item]:
    """Draw the image of the print."""
    ink = Ink(np.invert(side.pixels), palette.TEXT, into(place, view))
    label = Text(
        place.x + 12, place.y + 30, side.name, CAPTION_SIZE, side.tint.mark, bold=0.5, halo=4.0
    )
    return panel(place, [ink, label])


def ridge_panel(side: Side, place: Box, view: Box) -> list[Item]:
    """Draw the skeleton, and the minutiae on it with kind and direction."""
    matrix = into(place, view)
    thick = np.asarray(cv2.dilate(side.skeleton.astype(np.uint8) * 255, np.ones((2, 2))), np.uint8)
    every = range(len(side.template.minutiae))
    drawn = marks(side.template.minutiae, every, matrix, _small(side.tint.mark), place)
    return panel(place, [Ink(thick, SKELETON_INK, matrix), *drawn])


def _small(colour: Colour) -> MarkStyle:
    return replace(
        PAIRED["reference"], colour=colour, radius=5.0, tick_px=10.0, width=2.4, halo=1.6
    )


def mesh_panel(side: Side, place: Box, view: Box, i: int, ring: list[int]) -> list[Item]:
    """Draw the triangulation, and in it the ring of minutia `i`, numbered."""
    matrix = into(place, view)
    points = moved(matrix, side.template.minutiae.xy)
    edge, strong = Pen(MESH, width=1.8), Pen(side.tint.mark, width=3.4)
    items: list[Item] = [Line((points[a], points[b]), edge) for a, b in side.mesh.edges]
    items.append(
        Line(tuple(points[k] for k in ring), Pen(fill=side.tint.ink, opacity=0.3), closed=True)
    )
    items += [Line((points[i], points[k]), replace(strong, width=2.2)) for k in ring]
    items.append(Line(tuple(points[k] for k in ring), strong, closed=True))
    items += [Circle(p, 3.6, Pen(fill=palette.NEUTRAL_INK)) for p in points]
    middle = np.mean([points[k] for k in ring], axis=0)
    for n, k in enumerate(ring, start=1):
        items.append(Circle(points[k], 5.5, Pen(fill=side.tint.mark)))
        items.append(_number(n, points[k], points[k] - middle, 20.0))
    direction = direction_on_page(matrix, float(side.template.minutiae.angle[i]))
    items += _pointer(points[i], direction)
    return panel(place, items)


def _number(n: int, at: Point, away: NDArray[Any], distance: float) -> Text:
    """Write a neighbour's number beside it, on the side that points `away`."""
    dx, dy = np.asarray(away) / np.hypot(*away) * distance
    x, y = at[0] + float(dx), at[1] + float(dy) + LABEL_SIZE * 0.36
    return Text(x, y, str(n), LABEL_SIZE, palette.TEXT, "middle", bold=0.5, halo=3.0)


def circle_panel(
    side: Side, place: Box, circle: UnitCircle, beside: UnitCircle | None
) -> list[Item]:
    """Draw a ring on the unit circle, its points numbered, and hollow the probe's where given."""
    centre = (place.x + place.width / 2 - 8, place.y + place.height / 2)
    spots, image = _on_page(circle.boundary, centre), _on_page(circle.image[None], centre)[0]
    spoke, outline = Pen(side.tint.mark, width=1.4), Pen(side.tint.mark, width=2.6)
    items: list[Item] = [
        Circle(centre, CIRCLE_RADIUS, Pen(palette.NEUTRAL_INK, palette.BAND, width=2.0))
    ]
    items += [Line((image, spot), spoke) for spot in spots]
    items.append(Line(tuple(spots), outline, closed=True))
    for n, (spot, weight) in enumerate(zip(spots, circle.weights, strict=True), start=1):
        items.append(Circle(spot, _dot(weight), Pen(palette.PAPER, side.tint.mark, width=1.5)))
        away = np.subtract(spot, centre)
        items.append(_number(n, spot, away, _dot(weight) + LABEL_SIZE))
    if beside is not None:
        for spot, weight in zip(_on_page(beside.boundary, centre), beside.weights, strict=True):
            items.append(Circle(spot, _dot(weight) + 2, Pen(palette.PROBE_INK, width=3.0)))
    return panel(place, [*items, Circle(image, 7.0, FOLLOWED)])


def _dot(weight: float) -> float:
    return LARGEST_DOT * math.sqrt(float(weight))


def _on_page(xy: NDArray[np.float64], centre: Point) -> list[Point]:
    """Return places in the unit circle (K, 2), y up, as places on the page."""
    x, y = centre
    return [(x + u, y - v) for u, v in (xy * CIRCLE_RADIUS).tolist()]


def _pointer(at: Point, direction: Point) -> list[Item]:
    """Draw the minutia that is followed, and its direction."""
    pen = Pen(palette.TEXT, width=4.0, halo=1.6)
    return [*arrow(at, direction, 44.0, pen, 15.0), Circle(at, 7.0, FOLLOWED)]


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
    moving = np.asarray(to_page @ of_transform(found.transform))
    ours, theirs = (Print(side.pixels, side.template) for side in (probe, reference))
    ridges = inks(ours, theirs, moving, to_page)
    return panel(place, [*ridges, *minutiae_and_pairs(found, moving, to_page, place)])


def how_it_works(probe_path: Path, reference_path: Path) -> NDArray[np.uint8]:
    """Draw the whole method, from two prints on the left to their overlay on the right."""
    probe = Side.of("probe", TINTS["P"], probe_path)
    reference = Side.of("reference", TINTS["Q"], reference_path)
    found = fpmatch.verify(probe.template, reference.template)
    i, j = followed_pair(probe, reference, found.pairs)
    partner = dict(found.pairs.tolist())
    ring = probe.ring(i)
    partners = [partner[k] for k in ring]
    beside: UnitCircle | None = None

    views = probe.view(), reference.view()
    size = max(v.width for v in views), max(v.height for v in views)
    height = PANEL_WIDTH * size[1] / size[0]
    top = MARGIN + TITLE_SIZE + 14
    widths = (PANEL_WIDTH, PANEL_WIDTH, PANEL_WIDTH, CIRCLE_WIDTH, OVERLAY_WIDTH)
    lefts = [MARGIN + sum(widths[:n]) + n * GAP for n in range(len(widths))]
    bottom = top + 2 * height + ROW_GAP

    items: list[Item] = []
    for side, minutia, numbered, y in (
        (probe, i, ring, top),
        (reference, j, partners, top + height + ROW_GAP),
    ):
        view = centred(side.view(), size)
        places = [Box(x, y, w, height) for x, w in zip(lefts, widths, strict=True)]
        items += print_panel(side, places[0], view)
        items += ridge_panel(side, places[1], view)
        items += mesh_panel(side, places[2], view, minutia, numbered)
        circle = side.circle(minutia, numbered)
        items += circle_panel(side, places[3], circle, beside)
        beside = circle
    place = Box(lefts[4], top, OVERLAY_WIDTH, bottom - top)
    items += overlay_panel(probe, reference, found, place)
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

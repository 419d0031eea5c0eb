"""The paper's Figure 4: a one-ring on the unit circle by eq. (3), with the weights of eq. (4)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import NEUTRAL_INK, TEXT, TEXT_MUTED
from fpmatch.drawing.paper_figures.circle_marks import circle_names, image, show_circle, spoked
from fpmatch.drawing.paper_figures.marks import (
    SPOKE,
    TINTS,
    dots,
    label_size,
    line,
    polygon,
    ring_lines,
    ring_names,
    roomiest,
)
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.paper_figures.table import table
from fpmatch.drawing.paper_figures.text import label
from fpmatch.drawing.paper_figures.words import degrees, name, number, significant

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.ring import Ring

    Floats = NDArray[np.float64]

PANEL_HEIGHT: Final = 350
RING_ROOM: Final = 50.0  # pixels around a ring, for its names
ARC_DISTANCE: Final = 7.0  # pixels from the circle to an arc's label
SIDE_DISTANCE: Final = 7.0  # pixels from a side to its length
SECTOR_DEPTH: Final = 0.62  # where a sector's area is written, from the middle to the chord
LEAST_DEPTH: Final = 0.3  # of a chord, from the middle, for a label before it
CROSS: Final = 0.04  # arms of the cross in the middle of the circle
SPOKE_PLACES: Final = (0.55, 0.5, 0.6, 0.45, 0.65, 0.4)  # of a weight's label along its spoke
IMAGE_NAME: Final = 0.15  # from a centre's image to its name, on the unit circle
LABEL_ASPECT: Final = 2.5  # width over height of a weight's label


def unit_circle(ring: Ring) -> Sheet:
    """Draw Figure 4: the ring, its place on the unit circle, its weights and its numbers."""
    circle = ring.circle
    off_middle = math.hypot(*circle.image)
    x, y = (number(value) for value in circle.image)
    caption = (
        f"Point {ring.centre} of {ring.side.letter} and its ring of {len(ring)}. "
        f"(a) Sides b, in the units of the points; in all "
        f"{_length(ring, ring.sides.sum())}. "
        f"(b) Each side takes its share of 360° (eq. 3), from p₁ at 0° on. Sectors of the "
        f"inscribed polygon, seen from the middle, have the areas ½·sin dA: together "
        f"{number(circle.area)}, the number that local matching compares (the circle's own is "
        f"{number(math.pi)}). "
        f"(c) On the spokes: weights λ of eq. (4), which sum to {number(circle.weights.sum())}. "
        f"They give the centre's image c = Σ λu = ({x}, {y}), {number(off_middle)} off the middle."
    )
    sheet = Sheet(
        "Figure 4. A one-ring on the unit circle", caption, 2, [PANEL_HEIGHT, PANEL_HEIGHT]
    )
    axes = sheet.panel(0, 0, "(a) one-ring, with the lengths of its sides")
    _ring_with_sides(axes, ring)
    axes = sheet.panel(0, 1, "(b) boundary by chord length, areas of sectors")
    _boundary(axes, ring)
    axes = sheet.panel(1, 0, "(c) image of the centre, weights on the spokes")
    _weights(axes, ring)
    axes = sheet.panel(1, 1, "(d) the numbers", framed=False)
    _numbers(axes, ring)
    return sheet


def _ring_with_sides(axes: Axes, ring: Ring) -> None:
    show(axes, ring.points, RING_ROOM)
    ring_lines(axes, ring)
    ring_names(axes, ring)
    middle = ring.points.mean(axis=0)
    following = np.roll(ring.points, -1, axis=0)
    for start, end, side in zip(ring.points, following, ring.sides, strict=True):
        across = np.array([end[1] - start[1], start[0] - end[0]])
        half = (start + end) / 2
        outward = across if across @ (half - middle) > 0 else -across
        label(
            axes,
            half,
            _length(ring, side),
            away=outward,
            distance=SIDE_DISTANCE,
            size=label_size(ring),
            colour=TEXT_MUTED,
        )


def _boundary(axes: Axes, ring: Ring) -> None:
    tint, boundary = TINTS[ring.side.letter], ring.circle.boundary
    show_circle(axes)
    polygon(axes, boundary, tint)
    for point in boundary:
        line(axes, [(0.0, 0.0), point], NEUTRAL_INK, SPOKE, dashed=True)
    dots(axes, boundary, tint)
    size = label_size(ring)
    circle_names(axes, boundary, [name(ring.side.letter, k) for k in range(len(ring))], size)
    for start, arc, area in zip(ring.circle.angles, ring.arcs, ring.sectors, strict=True):
        half = start + arc / 2
        outward = np.array([math.cos(half), math.sin(half)])
        label(
            axes,
            outward,
            degrees(math.degrees(arc)),
            away=outward,
            distance=ARC_DISTANCE,
            size=size,
            colour=TEXT_MUTED,
        )
        to_chord = max(math.cos(arc / 2), LEAST_DEPTH)
        label(axes, SECTOR_DEPTH * to_chord * outward, number(area), size=size)


def _weights(axes: Axes, ring: Ring) -> None:
    circle = ring.circle
    show_circle(axes)
    spoked(axes, ring.side.letter, circle.boundary, circle.image)
    line(axes, [(-CROSS, 0.0), (CROSS, 0.0)], TEXT, SPOKE)
    line(axes, [(0.0, -CROSS), (0.0, CROSS)], TEXT, SPOKE)
    size = label_size(ring)
    names = [name(ring.side.letter, k) for k in range(len(ring))]
    circle_names(axes, circle.boundary, names, size)
    image(axes, circle.image, ring.side.letter, circle.boundary)
    beside = circle.image + IMAGE_NAME * roomiest(circle.boundary - circle.image)
    taken = [circle.image, beside, *circle.boundary]
    for point, weight in zip(circle.boundary, circle.weights, strict=True):
        places = [circle.image + share * (point - circle.image) for share in SPOKE_PLACES]
        at = max(places, key=lambda place: min(_apart(place, other) for other in taken))
        taken.append(at)
        label(axes, at, number(weight), size=size)


def _apart(place: Floats, other: Floats) -> float:
    """Return how far apart two labels stand, in their heights."""
    x, y = np.abs(place - other).tolist()
    return float(max(x / LABEL_ASPECT, y))


def _numbers(axes: Axes, ring: Ring) -> None:
    circle = ring.circle
    rows = [
        [
            name(ring.side.letter, k),
            _length(ring, ring.sides[k]),
            degrees(math.degrees(ring.arcs[k])),
            degrees(math.degrees(circle.angles[k])),
            number(ring.sectors[k]),
            number(circle.weights[k]),
        ]
        for k in range(len(ring))
    ]
    whole = [
        "Σ",
        _length(ring, ring.sides.sum()),
        degrees(math.degrees(float(ring.arcs.sum()))),
        "",
        number(circle.area),
        number(circle.weights.sum()),
    ]
    table(axes, ["", "side b", "arc dA", "angle A", "sector", "weight λ"], rows, whole)


def _length(ring: Ring, in_frame: float) -> str:
    """Write a length in the units of the points, to four digits."""
    return significant(ring.side.length(float(in_frame)), 4)

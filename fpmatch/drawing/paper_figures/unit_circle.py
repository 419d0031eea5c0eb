"""The paper's Figure 4: a one-ring on the unit circle by eq. (3), with the weights of eq. (4)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import NEUTRAL_INK, TEXT, TEXT_MUTED
from fpmatch.drawing.paper_figures.marks import SPOKE, TINTS, dots, label, line, polygon, table
from fpmatch.drawing.paper_figures.ring_marks import (
    circle_names,
    circle_ring,
    label_size,
    plane_ring,
    ring_names,
    roomiest,
    unit_circle_frame,
)
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.words import degrees, number, significant

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.rings import Ring

    Floats = NDArray[np.float64]

HEIGHTS: Final = (342, 342)
RING_ROOM: Final = 50.0  # pixels around a ring, for its names
LABEL_DISTANCE: Final = 7.0  # pixels from an arc or a side to its label
SECTOR_DEPTH: Final = 0.62  # where a sector's area is written, from the middle to the chord
LEAST_DEPTH: Final = 0.3  # the least distance of a chord from the middle that is assumed for it
CROSS: Final = 0.04  # arms of the cross in the middle of the circle
SPOKE_PLACES: Final = (0.55, 0.5, 0.6, 0.45, 0.65, 0.4)  # of a weight's label along its spoke
IMAGE_NAME: Final = 0.15  # from a centre's image to its name, on the unit circle
LABEL_ASPECT: Final = 2.5  # width over height of a weight's label


def unit_circle(ring: Ring) -> Sheet:
    """Draw Figure 4: the ring, its place on the unit circle, its weights and its numbers."""
    circle = ring.circle
    x, y = (number(value) for value in circle.image)
    caption = (
        f"Point {ring.centre} of {ring.side.letter} and its ring of {len(ring)}. "
        f"(a) Sides b, in the units of the points; in all {_length(ring, ring.sides.sum())}. "
        f"(b) The arc of a side is proportional to its length (eq. 3), from p₁ at 0° on. Sectors "
        f"of the inscribed polygon have the areas ½·sin dA: together {number(circle.area)}, the "
        f"number that local matching compares (the circle's own is {number(math.pi)}). "
        f"(c) On the spokes: weights λ of eq. (4), which sum to {number(circle.weights.sum())}. "
        f"They give the centre's image c = Σ λu = ({x}, {y}), "
        f"{number(math.hypot(*circle.image))} off the middle."
    )
    sheet = Sheet("Figure 4. A one-ring on the unit circle", caption, ["ab", "cd"], HEIGHTS)
    _ring_with_sides(sheet.panel("a", "(a) one-ring, with the lengths of its sides"), ring)
    _boundary(sheet.panel("b", "(b) boundary by chord length, areas of sectors"), ring)
    _weights(sheet.panel("c", "(c) image of the centre, weights on the spokes"), ring)
    columns = (
        ["", *ring.names, "Σ"],
        ["side b", *(_length(ring, b) for b in (*ring.sides, ring.sides.sum()))],
        ["arc dA", *map(degrees, (*ring.arcs, ring.arcs.sum()))],
        ["angle A", *map(degrees, circle.angles), ""],
        ["sector", *map(number, (*ring.sectors, circle.area))],
        ["weight λ", *map(number, (*circle.weights, circle.weights.sum()))],
    )
    table(sheet.panel("d", "(d) the numbers"), list(zip(*columns, strict=True)))
    return sheet


def _ring_with_sides(axes: Axes, ring: Ring) -> None:
    show(axes, ring.points, RING_ROOM)
    plane_ring(axes, ring)
    ring_names(axes, ring)
    following = np.roll(ring.points, -1, axis=0)
    for start, end, side in zip(ring.points, following, ring.sides, strict=True):
        outward = np.array([end[1] - start[1], start[0] - end[0]])  # the ring is counter-clockwise
        _muted(axes, (start + end) / 2, _length(ring, side), outward, ring)


def _muted(axes: Axes, at: Floats, text: str, away: Floats, ring: Ring) -> None:
    size = label_size(ring)
    label(axes, at, text, away=away, distance=LABEL_DISTANCE, size=size, colour=TEXT_MUTED)


def _boundary(axes: Axes, ring: Ring) -> None:
    tint, boundary = TINTS[ring.side.letter], ring.circle.boundary
    unit_circle_frame(axes)
    polygon(axes, boundary, tint)
    for point in boundary:
        line(axes, [(0.0, 0.0), point], NEUTRAL_INK, SPOKE, dashed=True)
    dots(axes, boundary, tint)
    circle_names(axes, boundary, ring.names, label_size(ring))
    for start, arc, area in zip(ring.circle.angles, ring.arcs, ring.sectors, strict=True):
        half = start + arc / 2
        outward = np.array([math.cos(half), math.sin(half)])
        _muted(axes, outward, degrees(arc), outward, ring)
        to_chord = max(math.cos(arc / 2), LEAST_DEPTH)
        label(axes, SECTOR_DEPTH * to_chord * outward, number(area), size=label_size(ring))


def _weights(axes: Axes, ring: Ring) -> None:
    circle = ring.circle
    circle_ring(axes, ring)
    line(axes, [(-CROSS, 0.0), (CROSS, 0.0)], TEXT, SPOKE)
    line(axes, [(0.0, -CROSS), (0.0, CROSS)], TEXT, SPOKE)
    beside = circle.image + IMAGE_NAME * roomiest(circle.boundary - circle.image)
    taken = [circle.image, beside, *circle.boundary]
    for point, weight in zip(circle.boundary, circle.weights, strict=True):
        places = [circle.image + share * (point - circle.image) for share in SPOKE_PLACES]
        at = max(places, key=lambda place: min(_apart(place, other) for other in taken))
        taken.append(at)
        label(axes, at, number(weight), size=label_size(ring))


def _apart(place: Floats, other: Floats) -> float:
    """Return the distance of two labels, in their heights."""
    x, y = np.abs(place - other).tolist()
    return float(max(x / LABEL_ASPECT, y))


def _length(ring: Ring, in_frame: float) -> str:
    """Write a length in the units of the points, to four digits."""
    return significant(ring.side.length(float(in_frame)), 4)

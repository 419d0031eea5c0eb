"""The paper's Figures 4 and 5: a one-ring on the unit circle, and the weights of its points."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.drawing.scene.palette import NEUTRAL_INK, TEXT, TEXT_MUTED
from fpmatch.lab.paper_figures import marks
from fpmatch.lab.paper_figures.sheet import Sheet, show
from fpmatch.lab.plots.words import degrees, number, significant

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.paper_figures.rings import Ring

    Floats = NDArray[np.float64]

RING_ROOM: Final = 50.0  # pixels around a ring, for its names
SIDE_DISTANCE: Final = 7.0  # pixels from an arc or a side to its label
SECTOR_DEPTH: Final = 0.62  # where a sector's area is written, from the middle to the chord
LEAST_DEPTH: Final = 0.3  # the least distance of a chord from the middle that is assumed for it
CROSS: Final = 0.04  # arms of the cross in the middle of the circle
SPOKE_PLACES: Final = (0.55, 0.5, 0.6, 0.45, 0.65, 0.4)  # of a weight's label along its spoke
IMAGE_NAME: Final = 0.15  # from a centre's image to its name, on the unit circle
LABEL_ASPECT: Final = 2.5  # width over height of a weight's label
COLUMNS: Final = 3  # of sub-triangles
TRIANGLE_HEIGHT, TABLE_HEIGHT = 192, 262
ROOM, WIDE_ROOM = 30.0, 54.0  # pixels around a ring, for names and for numbers


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
    sheet = Sheet("Figure 4. A one-ring on the unit circle", caption, ["ab", "cd"], (342, 342))
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
    marks.table(sheet.panel("d", "(d) the numbers"), list(zip(*columns, strict=True)))
    return sheet


def _ring_with_sides(axes: Axes, ring: Ring) -> None:
    marks.plane_ring(axes, ring, RING_ROOM)
    marks.ring_names(axes, ring)
    following = np.roll(ring.points, -1, axis=0)
    for start, end, side in zip(ring.points, following, ring.sides, strict=True):
        outward = np.array([end[1] - start[1], start[0] - end[0]])  # the ring is counter-clockwise
        _muted(axes, (start + end) / 2, _length(ring, side), outward, ring)


def _muted(axes: Axes, at: Floats, text: str, away: Floats, ring: Ring) -> None:
    size = marks.label_size(ring)
    marks.label(axes, at, text, away=away, distance=SIDE_DISTANCE, size=size, colour=TEXT_MUTED)


def _boundary(axes: Axes, ring: Ring) -> None:
    tint, boundary = marks.TINTS[ring.side.letter], ring.circle.boundary
    marks.unit_circle_frame(axes)
    marks.polygon(axes, boundary, tint)
    for point in boundary:
        marks.line(axes, [(0.0, 0.0), point], NEUTRAL_INK, marks.SPOKE, "--")
    marks.dots(axes, boundary, tint)
    marks.circle_names(axes, boundary, ring.names, marks.label_size(ring))
    for start, arc, area in zip(ring.circle.angles, ring.arcs, ring.sectors, strict=True):
        half = start + arc / 2
        outward = np.array([math.cos(half), math.sin(half)])
        _muted(axes, outward, degrees(arc), outward, ring)
        depth = SECTOR_DEPTH * max(math.cos(arc / 2), LEAST_DEPTH)
        marks.label(axes, depth * outward, number(area), size=marks.label_size(ring))


def _weights(axes: Axes, ring: Ring) -> None:
    circle = ring.circle
    marks.circle_ring(axes, ring)
    marks.line(axes, [(-CROSS, 0.0), (CROSS, 0.0)], TEXT, marks.SPOKE)
    marks.line(axes, [(0.0, -CROSS), (0.0, CROSS)], TEXT, marks.SPOKE)
    beside = circle.image + IMAGE_NAME * marks.roomiest(circle.boundary - circle.image)
    taken = [circle.image, beside, *circle.boundary]
    for point, weight in zip(circle.boundary, circle.weights, strict=True):
        places = [circle.image + share * (point - circle.image) for share in SPOKE_PLACES]
        at = max(places, key=lambda place: min(_apart(place, other) for other in taken))
        taken.append(at)
        marks.label(axes, at, number(weight), size=marks.label_size(ring))


def _apart(place: Floats, other: Floats) -> float:
    """Return the distance of two labels, in their heights."""
    x, y = np.abs(place - other).tolist()
    return float(max(x / LABEL_ASPECT, y))


def _length(ring: Ring, in_frame: float) -> str:
    """Write a length in the units of the points, to four digits."""
    return significant(ring.side.length(float(in_frame)), 4)


class SubTriangle(NamedTuple):
    """The triangle that one point of a ring forms with the side across the centre.

    `corners` are the places in the ring of p_l, p_r and p_{r+1}: the line from p_l through the
    centre leaves the ring between the latter two. `shares` are δ1, δ2, δ3, the barycentric
    coordinates of the centre, which are not negative and sum to 1.
    """

    corners: tuple[int, int, int]
    shares: tuple[float, float, float]


def sub_triangles(ring: ArrayLike, centre: ArrayLike) -> list[SubTriangle]:
    """Return the sub-triangle of every point of a ring, in order.

    The ring (d, 2) is counter-clockwise around the centre (2,). The mean share of a point over all
    triangles is its weight λ.
    """
    away = np.asarray(ring, dtype=np.float64) - np.asarray(centre, dtype=np.float64)
    d = len(away)
    cross = np.outer(away[:, 0], away[:, 1])
    cross = cross - cross.T  # twice the area of centre, point, point
    triangles = []
    for first in range(d):
        r = next(r for r in range(d) if cross[first, r] >= 0 > cross[first, (r + 1) % d])
        s = (r + 1) % d
        areas = np.array([cross[r, s], cross[s, first], cross[first, r]])
        one, two, three = (areas / areas.sum()).tolist()
        triangles.append(SubTriangle((first, r, s), (one, two, three)))
    return triangles


def shares_table(triangles: list[SubTriangle]) -> Floats:
    """Return μ_{k,l}, the share of point k (row) in the sub-triangle of point l, shape (d, d)."""
    mu = np.zeros((len(triangles), len(triangles)))
    for column, triangle in enumerate(triangles):
        mu[list(triangle.corners), column] += triangle.shares
    return mu


def weights(ring: Ring) -> Sheet:
    """Draw Figure 5: each sub-triangle with its shares, and the weights as their means."""
    triangles = sub_triangles(ring.points, ring.middle)
    mu = shares_table(triangles)
    mean = mu.mean(axis=1)
    d, letter = len(ring), ring.side.letter.lower()
    caption = (
        f"For each of the {d} points of the ring, the line from it through the centre "
        f"{letter} (hollow) leaves the ring by one of its sides. Point and side form a triangle "
        f"around {letter}; above it are the barycentric coordinates δ of {letter}, which sum to 1. "
        f"A point's weight λ is the mean of its shares over all {d} triangles (eq. 4): "
        f"from {number(mean.min())} to {number(mean.max())} here, in all {number(mean.sum())}. "
        f"With these weights Σ λ{letter} equals {letter}."
    )
    keys = [f"triangle {n}" for n in range(d)]
    padded = keys + ["."] * (-d % COLUMNS)
    mosaic = [padded[n : n + COLUMNS] for n in range(0, d, COLUMNS)]
    heights = [TRIANGLE_HEIGHT] * len(mosaic) + [TABLE_HEIGHT]
    mosaic.append(["means", *["shares"] * (COLUMNS - 1)])
    sheet = Sheet("Figure 5. Weights from sub-triangles", caption, mosaic, heights)
    for key, triangle in zip(keys, triangles, strict=True):
        terms = (
            f"{number(share, 2)} {ring.names[place]}"
            for place, share in zip(triangle.corners, triangle.shares, strict=True)
        )
        _sub_triangle(sheet.panel(key, f"{letter} = {' + '.join(terms)}"), ring, triangle)
    axes = sheet.panel("means", "the mean of all: weights λ")
    marks.plane_ring(axes, ring, WIDE_ROOM)
    for place, weight in enumerate(mean):
        _outside(axes, ring, place, number(weight), marks.label_size(ring))
    rows = [
        [name, *(number(share, 2) if share else "·" for share in row), number(weight)]
        for name, row, weight in zip(ring.names, mu, mean, strict=True)
    ]
    head = ["", *(f"l = {place}" for place in range(1, d + 1)), "mean λ"]
    sums = ["Σ", *(number(value, 2) for value in mu.sum(axis=0)), number(mean.sum())]
    axes = sheet.panel("shares", "shares of the points (rows) in the triangles (columns)")
    marks.table(axes, [head, *rows, sums])
    return sheet


def _outside(axes: Axes, ring: Ring, place: int, text: str, size: float) -> None:
    """Write beside a point of a ring, outside it."""
    at = ring.points[place]
    marks.label(axes, at, text, away=at - ring.points.mean(axis=0), size=size)


def _sub_triangle(axes: Axes, ring: Ring, triangle: SubTriangle) -> None:
    tint = marks.TINTS[ring.side.letter]
    show(axes, ring.points, ROOM)
    marks.line(axes, marks.closed(ring.points), NEUTRAL_INK, marks.SPOKE)
    corners = ring.points[list(triangle.corners)]
    marks.polygon(axes, corners, tint)
    _, two, three = triangle.shares
    leaves = (two * corners[1] + three * corners[2]) / (two + three)
    marks.line(axes, [corners[0], leaves], TEXT, marks.SPOKE, "--")
    marks.dots(axes, corners, tint)
    marks.dots(axes, ring.middle, tint, marks.CENTRE_DOT, hollow=True)
    for place in sorted(set(triangle.corners)):
        _outside(axes, ring, place, ring.names[place], marks.LABEL_SIZE)

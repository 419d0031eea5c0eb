"""The paper's Figure 6, first page: the unit circles of two rings that correspond."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.paper_figures.marks import (
    OUTLINE,
    SPOKE,
    STACKED_DOT,
    TINTS,
    dots,
    line,
    table,
)
from fpmatch.drawing.paper_figures.ring_marks import (
    circle_names,
    circle_ring,
    label_size,
    rotated,
    unit_circle_frame,
)
from fpmatch.drawing.paper_figures.sheet import Sheet
from fpmatch.drawing.words import degrees, number, positive_degrees
from fpmatch.pointset.unit_circle.matcher import UnitCircleParameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fpmatch.drawing.paper_figures.rings import RingPair

HEIGHTS: Final = (342, 342)
PAPER: Final = UnitCircleParameters()


def two_circles(rings: RingPair) -> Sheet:
    """Draw Figure 6, first page: both circles, one aligned with the other, and their angles."""
    p, q = rings.p, rings.q
    first, true = (q.names[shift] for shift in (rings.shift, rings.true_shift))
    apart = abs(p.circle.area - q.circle.area)
    images = math.hypot(*(rotated(p.circle.image, rings.turn) - q.circle.image))
    wrong = "" if first == true else f" But the true partner of p₁ is {true}: the ring is regular."
    caption = (
        f"Both rings have {len(p)} points, and their polygons the areas "
        f"{number(p.circle.area)} and {number(q.circle.area)}: {apart:.2g} apart, so they "
        f"{'match' if apart <= PAPER.area_tolerance else 'do not match'} within "
        f"the tolerance of {PAPER.area_tolerance:g}. Each circle begins at 0° with "
        f"the first point of its own list, so one is rotated against the other. The circles agree "
        f"best after a cyclic shift by {rings.shift}: p₁ corresponds to {first}, and P's circle is "
        f"rotated by {degrees(rings.turn)}. Then no point is more than "
        f"{degrees(np.abs(rings.deviations).max())} from its partner, and the centres' images "
        f"are {number(images)} apart.{wrong}"
    )
    sheet = Sheet("Figure 6. Two unit circles side by side", caption, ["ab", "cd"], HEIGHTS)
    for key, ring in zip("ab", (p, q), strict=True):
        axes = sheet.panel(key, f"({key}) {ring.side.letter}: ring of point {ring.centre}")
        circle_ring(axes, ring)
    axes = sheet.panel("c", f"(c) P's circle rotated by {degrees(rings.turn)}, on Q's")
    aligned_circles(axes, rings)
    of_p, of_q = p.circle.angles, q.circle.angles[rings.partner]
    columns = (
        ["", *rings.names],
        ["A of P", *map(degrees, of_p)],
        ["A of Q", *map(degrees, of_q)],
        ["rotation", *map(positive_degrees, of_q - of_p)],
        ["deviation", *map(degrees, rings.deviations)],
    )
    rows = [*zip(*columns, strict=True), _image_row(rings)]
    table(sheet.panel("d", "(d) angles on the circles"), rows)
    return sheet


def aligned_circles(axes: Axes, rings: RingPair) -> None:
    """Draw Q's circle, and P's rotated onto it."""
    unit_circle_frame(axes)
    for ring, angle in ((rings.q, 0.0), (rings.p, rings.turn)):
        letter, tint = ring.side.letter, TINTS[ring.side.letter]
        boundary, image = (rotated(xy, angle) for xy in (ring.circle.boundary, ring.circle.image))
        line(axes, np.vstack([boundary, boundary[:1]]), tint.mark, OUTLINE)
        for point in boundary:
            line(axes, [image, point], tint.mark, SPOKE)
        for points in (boundary, image):
            dots(axes, points, tint, STACKED_DOT[letter], hollow=letter == "Q")
    boundary = rings.q.circle.boundary[rings.partner]
    circle_names(axes, boundary, rings.names, label_size(rings.q))


def _image_row(rings: RingPair) -> list[str]:
    """Return the row of the table for the directions of the centres' images from the middle."""
    if rings.image_rotation is None:
        return ["$c_p$ $c_q$", "none", "none", "", ""]
    of_p, of_q = (math.atan2(*ring.circle.image[::-1]) for ring in (rings.p, rings.q))
    off = math.remainder(of_q - of_p - rings.turn, 2 * math.pi)
    directions = map(positive_degrees, (of_p, of_q, of_q - of_p))
    return ["$c_p$ $c_q$", *directions, degrees(off)]

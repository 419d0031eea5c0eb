"""The paper's Figure 6, first page: the unit circles of two rings that correspond."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.paper_figures.circle_marks import (
    circle_names,
    image,
    show_circle,
    spoked,
    turned,
)
from fpmatch.drawing.paper_figures.marks import (
    OUTLINE,
    SPOKE,
    STACKED_DOT,
    TINTS,
    dots,
    label_size,
    line,
)
from fpmatch.drawing.paper_figures.sheet import Sheet
from fpmatch.drawing.paper_figures.table import table
from fpmatch.drawing.paper_figures.words import around, degrees, name, number
from fpmatch.pointset.unit_circle.matcher import UnitCircleParameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.ring import RingPair

    Floats = NDArray[np.float64]

PANEL_HEIGHT: Final = 350
PAPER: Final = UnitCircleParameters()


def two_circles(rings: RingPair) -> Sheet:
    """Draw Figure 6, first page: both circles, one laid on the other, and their angles."""
    p, q = rings.p, rings.q
    first = name("Q", int(rings.partner[0]))
    apart = abs(p.circle.area - q.circle.area)
    wrong = (
        f" But the true partner of p₁ is {name('Q', rings.true_shift)}: a ring this even looks the "
        "same from several sides."
        if rings.shift != rings.true_shift
        else ""
    )
    caption = (
        f"Both rings have {len(p)} points, and their polygons the areas "
        f"{number(p.circle.area)} and {number(q.circle.area)}: {apart:.2g} apart, so they "
        f"{'match' if apart <= PAPER.area_tolerance else 'do not match'} within "
        f"the tolerance of {PAPER.area_tolerance:g}. Each circle begins at 0° with "
        f"the first point of its own list, so one is turned against the other. The circles lie "
        f"best on one another after a cyclic shift by {rings.shift}: p₁ goes with {first}, and P's "
        f"circle is turned by {degrees(math.degrees(rings.turn))}. Then no point is more than "
        f"{degrees(float(np.abs(_left(rings)).max()))} from its partner, and the centres' images "
        f"are {number(_images_apart(rings))} apart.{wrong}"
    )
    sheet = Sheet(
        "Figure 6. Two unit circles side by side", caption, 2, [PANEL_HEIGHT, PANEL_HEIGHT]
    )
    for column, ring in enumerate((p, q)):
        letter = ring.side.letter
        title = f"({'ab'[column]}) {letter}: ring of point {ring.centre}"
        axes = sheet.panel(0, column, title)
        show_circle(axes)
        texts = [name(letter, k) for k in range(len(ring))]
        spoked(axes, letter, ring.circle.boundary, ring.circle.image)
        circle_names(axes, ring.circle.boundary, texts, label_size(ring))
        image(axes, ring.circle.image, letter, ring.circle.boundary)
    axes = sheet.panel(
        1, 0, f"(c) P's circle turned by {degrees(math.degrees(rings.turn))}, on Q's"
    )
    laid_over(axes, rings)
    axes = sheet.panel(1, 1, "(d) angles on the circles", framed=False)
    _angles(axes, rings)
    return sheet


def _left(rings: RingPair) -> Floats:
    """Return how far each of P's points is from its partner after the turn, in degrees."""
    off = rings.q.circle.angles[rings.partner] - rings.p.circle.angles - rings.turn
    return np.asarray(np.degrees(np.angle(np.exp(1j * off))))


def _images_apart(rings: RingPair) -> float:
    return math.hypot(*(turned(rings.p.circle.image, rings.turn) - rings.q.circle.image))


def laid_over(axes: Axes, rings: RingPair) -> None:
    """Draw Q's circle, and P's turned onto it."""
    show_circle(axes)
    p, q = rings.p.circle, rings.q.circle
    _outlined(axes, "Q", q.boundary, q.image)
    _outlined(axes, "P", turned(p.boundary, rings.turn), turned(p.image, rings.turn))
    texts = [f"{name('P', k)} {name('Q', int(n))}" for k, n in enumerate(rings.partner)]
    circle_names(axes, q.boundary[rings.partner], texts, label_size(rings.q))


def _outlined(axes: Axes, letter: str, boundary: Floats, centre: Floats) -> None:
    """Draw a circle's polygon and spokes so that another's can lie on it."""
    tint = TINTS[letter]
    line(axes, np.vstack([boundary, boundary[:1]]), tint.mark, OUTLINE)
    for point in boundary:
        line(axes, [centre, point], tint.mark, SPOKE)
    for points in (boundary, centre):
        dots(axes, points, tint, STACKED_DOT[letter], hollow=letter == "Q")


def _angles(axes: Axes, rings: RingPair) -> None:
    p, q = rings.p.circle, rings.q.circle
    between = np.degrees(q.angles[rings.partner] - p.angles)
    rows = [
        [
            f"{name('P', k)} {name('Q', int(n))}",
            degrees(math.degrees(p.angles[k])),
            degrees(math.degrees(q.angles[n])),
            around(float(between[k])),
            degrees(float(left)),
        ]
        for k, (n, left) in enumerate(zip(rings.partner, _left(rings), strict=True))
    ]
    table(axes, ["", "A of P", "A of Q", "turn", "off the turn"], rows, _image_row(rings))


def _image_row(rings: RingPair) -> list[str]:
    """Write the directions of the centres' images from the middle, as of the points."""
    title = "$c_p$ $c_q$"
    if rings.image_rotation is None:
        return [title, "none", "none", "", ""]
    (of_p, of_q) = (math.atan2(*ring.circle.image[::-1]) for ring in (rings.p, rings.q))
    off = math.remainder(of_q - of_p - rings.turn, 2 * math.pi)
    directions = (around(math.degrees(angle)) for angle in (of_p, of_q, of_q - of_p))
    return [title, *directions, degrees(math.degrees(off))]

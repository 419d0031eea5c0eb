"""The paper's Figure 6, second page: circles turn as their points do, and the overlay."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import PAIR_LINK, TEXT
from fpmatch.drawing.paper_figures.circle_marks import (
    circle_names,
    image,
    show_circle,
    spoked,
    turned,
)
from fpmatch.drawing.paper_figures.marks import (
    EDGE,
    OUTLINE,
    STACKED_DOT,
    TINTS,
    dots,
    label_size,
    line,
    mesh_lines,
    ring_lines,
    ring_names,
    segments,
)
from fpmatch.drawing.paper_figures.meshes import EDGE_ROOM, crowding
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.paper_figures.table import table
from fpmatch.drawing.paper_figures.text import label
from fpmatch.drawing.paper_figures.words import degrees, name, significant
from fpmatch.pointset.pairing import greedy_pairs
from fpmatch.pointset.unit_circle.matcher import UnitCircleParameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.pair import PointPair
    from fpmatch.drawing.paper_figures.ring import Ring, RingPair

    Floats = NDArray[np.float64]

ROOM: Final = 40.0  # pixels around a ring, for its names
PALE_MESH: Final = (205, 208, 213)
HEIGHTS: Final = (300, 330, 350)
ARC_RADIUS: Final = 0.6  # of the arc between two images, in the distance of the nearer
LEAST_ARC_RADIUS: Final = 0.2
ARC_STEPS: Final = 60
ARC_DISTANCE: Final = 5.0  # pixels from the arc to its label
ANGLE_DEPTH: Final = 0.15  # from the arc to the middle of its label
NAMES_WIDTH: Final = 2.2  # of the first column of a table, in another's
MIDDLE: Final = np.zeros(2)
PAPER: Final = UnitCircleParameters()


def rotation(pair: PointPair, rings: RingPair) -> Sheet:
    """Draw Figure 6, second page: rotated rings, rotated circles, and the overlay they lead to."""
    p, q = rings.p, rings.q
    matched = matched_points(pair, rings)
    share = f"{len(matched)} of {len(pair.p.mesh)} points"
    caption = (
        f"{pair.origin} {name('P', 0)} goes with {name('Q', int(rings.partner[0]))}, and so on. "
        "Once each unit circle is turned to stand as its ring does, the rotation between the "
        "circles, and between the centres' images, is that of the points, the closer the less "
        "they are jittered. "
        "(e) P, moved by the least-squares fit of this one pair of rings, on Q. Under it "
        f"{share} of P (dots) come within t = {significant(_tolerance(pair))} of a point of Q "
        f"(squares; eq. 2 with λ = {PAPER.precision:g}), each of a point of its own."
        f"{' Hollow dots do not.' if len(matched) < len(pair.p.mesh) else ''}"
    )
    sheet = Sheet("Figure 6, continued. Circles turn as their points do", caption, 2, HEIGHTS)
    for column, ring in enumerate((p, q)):
        letter = ring.side.letter
        axes = sheet.panel(0, column, f"({'ab'[column]}) {letter}: the ring of point {ring.centre}")
        show(axes, ring.points, ROOM)
        mesh_lines(axes, ring.side.mesh, PALE_MESH)
        ring_lines(axes, ring)
        ring_names(axes, ring, in_mesh=True)
        title = f"({'cd'[column]}) {letter}: its unit circle, turned to stand so"
        _standing(sheet.panel(1, column, title), rings, ring)
    axes = sheet.panel(2, 0, f"(e) P laid on Q: {share} match")
    _overlay(axes, pair, rings.move.apply(pair.p.mesh.points), matched)
    axes = sheet.panel(2, 1, "(f) what each says of the move from P to Q", framed=False)
    _said(axes, pair, rings)
    return sheet


def matched_points(pair: PointPair, rings: RingPair) -> NDArray[np.int32]:
    """Return the pairs (K, 2) of points that match under the move of one pair of rings."""
    tolerance = PAPER.precision * pair.q.prepared.spacing
    return greedy_pairs(rings.move.apply(pair.p.mesh.points), pair.q.mesh.points, tolerance)


def _tolerance(pair: PointPair) -> float:
    """Return t of eq. (2) in the units of Q."""
    return pair.q.length(PAPER.precision * pair.q.prepared.spacing)


def _said(axes: Axes, pair: PointPair, rings: RingPair) -> None:
    """Write rotation and scale as the sets have them, and as rings, circles and images say."""
    image_rotation = rings.image_rotation
    rows = [
        [pair.known_as, _rotation(pair.transform.rotation), significant(pair.transform.scale)],
        [
            "rings, least squares",
            _rotation(rings.move.rotation),
            significant(rings.transform.scale),
        ],
        ["unit circles", _rotation(rings.circle_rotation), ""],
        ["$c_p$ to $c_q$", "none" if image_rotation is None else _rotation(image_rotation), ""],
    ]
    table(axes, ["", "rotation", "scale"], rows, first=NAMES_WIDTH)


def _rotation(angle: float) -> str:
    return degrees(math.degrees(math.remainder(angle, 2 * math.pi)))


def _standing(axes: Axes, rings: RingPair, ring: Ring) -> None:
    """Draw a circle turned to stand as its ring does; in Q's, the angle from P's image to its."""
    show_circle(axes)
    letter = ring.side.letter
    boundary, centre = (
        turned(xy, ring.standing) for xy in (ring.circle.boundary, ring.circle.image)
    )
    spoked(axes, letter, boundary, centre)
    circle_names(axes, boundary, [name(letter, k) for k in range(len(ring))], label_size(ring))
    line(axes, [MIDDLE, centre], TEXT, OUTLINE)
    taken = [boundary, MIDDLE[None]]
    if letter == "Q" and rings.image_rotation is not None:
        taken.append(_angle_between_images(axes, rings, centre)[None])
    image(axes, centre, letter, np.vstack(taken))


def _angle_between_images(axes: Axes, rings: RingPair, c_q: Floats) -> Floats:
    """Draw where P's image stands and the arc from it to Q's; return where the angle is written."""
    between = rings.image_rotation or 0.0
    c_p = turned(rings.p.circle.image, rings.p.standing)
    start = math.atan2(c_p[1], c_p[0])
    radius = max(LEAST_ARC_RADIUS, ARC_RADIUS * min(math.hypot(*c_p), math.hypot(*c_q)))
    along = start + np.linspace(0.0, between, ARC_STEPS)
    line(axes, [MIDDLE, c_p], TINTS["P"].mark, OUTLINE, dashed=True)
    line(axes, radius * np.column_stack([np.cos(along), np.sin(along)]), TEXT, EDGE)
    dots(axes, c_p, TINTS["P"], STACKED_DOT["P"])
    half = start + between / 2
    outward = np.array([math.cos(half), math.sin(half)])
    label(
        axes, radius * outward, degrees(math.degrees(between)), away=outward, distance=ARC_DISTANCE
    )
    return (radius + ANGLE_DEPTH) * outward


def _overlay(axes: Axes, pair: PointPair, moved: Floats, matched: NDArray[np.int32]) -> None:
    """Draw Q, and P moved onto it, with lines between the points that match."""
    pixel = show(axes, np.vstack([moved, pair.q.mesh.points]), EDGE_ROOM)
    mesh_lines(axes, pair.q.mesh, PALE_MESH)
    p_dot, q_dot = (STACKED_DOT[side] * crowding(pair.q, pixel) for side in "PQ")
    dots(axes, pair.q.mesh.points, TINTS["Q"], q_dot, hollow=True)
    i, j = matched.T
    segments(axes, np.stack([moved[i], pair.q.mesh.points[j]], axis=1), PAIR_LINK, EDGE)
    alone = np.setdiff1d(np.arange(len(moved)), i)
    dots(axes, moved[i], TINTS["P"], p_dot)
    dots(axes, moved[alone], TINTS["P"], p_dot, hollow=True)

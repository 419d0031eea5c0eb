"""The paper's Figure 6, second page: circles rotate as their points do, and the alignment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import PAIR_LINK, TEXT
from fpmatch.drawing.paper_figures.marks import (
    EDGE,
    OUTLINE,
    STACKED_DOT,
    TINTS,
    dots,
    label,
    line,
    mesh_lines,
    segments,
    table,
)
from fpmatch.drawing.paper_figures.meshes import EDGE_ROOM, crowding
from fpmatch.drawing.paper_figures.ring_marks import circle_ring, ring_in_mesh, rotated
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.words import degrees, significant
from fpmatch.pointset.pairing import greedy_pairs
from fpmatch.pointset.unit_circle.matcher import UnitCircleParameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.pair import PointPair
    from fpmatch.drawing.paper_figures.rings import Ring, RingPair

    Floats = NDArray[np.float64]

HEIGHTS: Final = (292, 322, 342)
ROOM: Final = 40.0  # pixels around a ring, for its names
PALE_MESH: Final = (205, 208, 213)
ARC_RADIUS: Final = 0.6  # of the arc between two images, in the distance of the nearer
LEAST_ARC_RADIUS: Final = 0.2
ARC_STEPS: Final = 60
ARC_DISTANCE: Final = 5.0  # pixels from the arc to its label
ANGLE_DEPTH: Final = 0.15  # from the arc to the middle of its label
NAMES_WIDTH: Final = 2.2  # of the first column of a table, in another's
MIDDLE: Final = np.zeros(2)
PAPER: Final = UnitCircleParameters()


def rotation(pair: PointPair, rings: RingPair) -> Sheet:
    """Draw Figure 6, second page: the rings, their circles aligned with them, and the overlay."""
    p, q = rings.p, rings.q
    matched = matched_points(pair, rings)
    share = f"{len(matched)} of {len(pair.p.mesh)} points"
    tolerance = significant(pair.q.length(PAPER.precision * pair.q.prepared.spacing))
    caption = (
        f"{pair.origin} {p.names[0]} corresponds to {q.names[rings.shift]}, and so on. "
        "Once each unit circle is aligned with its ring, the rotation between the circles, and "
        "between the centres' images, is that of the points, the closer the less they are "
        "jittered. (e) P, moved by the least-squares fit of this one pair of rings, over Q: "
        f"{share} of P (dots) are within t = {tolerance} of a point of Q (squares; eq. 2 with "
        f"λ = {PAPER.precision:g}), each of a different one."
        f"{' Hollow dots are not.' if len(matched) < len(pair.p.mesh) else ''}"
    )
    title = "Figure 6, continued. Circles rotate as their points do"
    sheet = Sheet(title, caption, ["ab", "cd", "ef"], HEIGHTS)
    for ring, (plane, circle) in zip((p, q), (("a", "c"), ("b", "d")), strict=True):
        letter = ring.side.letter
        axes = sheet.panel(plane, f"({plane}) {letter}: the ring of point {ring.centre}")
        ring_in_mesh(axes, ring, ROOM, PALE_MESH)
        axes = sheet.panel(circle, f"({circle}) {letter}: its unit circle, aligned with it")
        _aligned_circle(axes, rings, ring)
    axes = sheet.panel("e", f"(e) P aligned with Q: {share} match")
    _overlay(axes, pair, rings.move.apply(pair.p.mesh.points), matched)
    images = "none" if rings.image_rotation is None else degrees(rings.image_rotation)
    rows = [
        ["", "rotation", "scale"],
        [pair.transform_name, _within_half_turn(pair.transform.rotation),
         significant(pair.transform.scale)],
        ["rings, least squares", _within_half_turn(rings.move.rotation),
         significant(rings.transform.scale)],
        ["unit circles", degrees(rings.circle_rotation), ""],
        ["$c_p$ to $c_q$", images, ""],
    ]  # fmt: skip
    table(sheet.panel("f", "(f) the transform from P to Q"), rows, first=NAMES_WIDTH, sums=False)
    return sheet


def matched_points(pair: PointPair, rings: RingPair) -> NDArray[np.int32]:
    """Return the pairs (K, 2) of points that match under the transform of one pair of rings."""
    tolerance = PAPER.precision * pair.q.prepared.spacing
    return greedy_pairs(rings.move.apply(pair.p.mesh.points), pair.q.mesh.points, tolerance)


def _within_half_turn(angle: float) -> str:
    return degrees(math.remainder(angle, 2 * math.pi))


def _aligned_circle(axes: Axes, rings: RingPair, ring: Ring) -> None:
    """Draw a circle aligned with its ring; in Q's, the angle from P's image to its own."""
    avoid = [MIDDLE]
    image = rotated(ring.circle.image, ring.orientation)
    if ring is rings.q and rings.image_rotation is not None:
        avoid.append(_angle_between_images(axes, rings, image, rings.image_rotation))
    circle_ring(axes, ring, ring.orientation, avoid)
    line(axes, [MIDDLE, image], TEXT, OUTLINE)


def _angle_between_images(axes: Axes, rings: RingPair, c_q: Floats, between: float) -> Floats:
    """Draw P's image and the arc from it to Q's; return the place of the angle's label."""
    c_p = rotated(rings.p.circle.image, rings.p.orientation)
    start = math.atan2(c_p[1], c_p[0])
    radius = max(LEAST_ARC_RADIUS, ARC_RADIUS * min(math.hypot(*c_p), math.hypot(*c_q)))
    along = start + np.linspace(0.0, between, ARC_STEPS)
    line(axes, [MIDDLE, c_p], TINTS["P"].mark, OUTLINE, dashed=True)
    line(axes, radius * np.column_stack([np.cos(along), np.sin(along)]), TEXT, EDGE)
    dots(axes, c_p, TINTS["P"], STACKED_DOT["P"])
    half = start + between / 2
    outward = np.array([math.cos(half), math.sin(half)])
    label(axes, radius * outward, degrees(between), away=outward, distance=ARC_DISTANCE)
    return (radius + ANGLE_DEPTH) * outward


def _overlay(axes: Axes, pair: PointPair, moved: Floats, matched: NDArray[np.int32]) -> None:
    """Draw Q, and P moved onto it, with lines between the points that match."""
    q = pair.q.mesh.points
    pixel = show(axes, np.vstack([moved, q]), EDGE_ROOM)
    mesh_lines(axes, pair.q.mesh, PALE_MESH)
    p_dot, q_dot = (STACKED_DOT[side] * crowding(pair.q, pixel) for side in "PQ")
    dots(axes, q, TINTS["Q"], q_dot, hollow=True)
    i, j = matched.T
    segments(axes, np.stack([moved[i], q[j]], axis=1), PAIR_LINK, EDGE)
    dots(axes, moved[i], TINTS["P"], p_dot)
    dots(axes, np.delete(moved, i, axis=0), TINTS["P"], p_dot, hollow=True)

"""The paper's Figure 6: two unit circles that correspond, and the rotation that they recover."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.scene.palette import PAIR_LINK, TEXT
from fpmatch.lab.paper_figures import marks
from fpmatch.lab.paper_figures.meshes import EDGE_ROOM, crowding
from fpmatch.lab.paper_figures.sheet import Sheet, show
from fpmatch.lab.plots.words import degrees, number, positive_degrees, significant
from fpmatch.pointset.geometry.pairing import greedy_pairs
from fpmatch.pointset.paper.matcher import UnitCircleParameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.lab.paper_figures.pair import PointPair
    from fpmatch.lab.paper_figures.rings import Ring, RingPair
    from fpmatch.pointset.geometry.similarity import Similarity

    Floats = NDArray[np.float64]

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


def two_circles(rings: RingPair) -> Sheet:
    """Draw the first page: both circles, one aligned with the other, and their angles."""
    p, q = rings.p, rings.q
    first, true = (q.names[shift] for shift in (rings.shift, rings.true_shift))
    apart = abs(p.circle.area - q.circle.area)
    images = math.hypot(*(marks.rotated(p.circle.image, rings.turn) - q.circle.image))
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
    sheet = Sheet("Figure 6. Two unit circles side by side", caption, ["ab", "cd"], (342, 342))
    for key, ring in zip("ab", (p, q), strict=True):
        axes = sheet.panel(key, f"({key}) {ring.side.letter}: ring of point {ring.centre}")
        marks.circle_ring(axes, ring)
    aligned_circles(sheet, "c", rings)
    of_p, of_q = p.circle.angles, q.circle.angles[rings.partner]
    columns = (
        ["", *rings.names],
        ["A of P", *map(degrees, of_p)],
        ["A of Q", *map(degrees, of_q)],
        ["rotation", *map(positive_degrees, of_q - of_p)],
        ["deviation", *map(degrees, rings.deviations)],
    )
    rows = [*zip(*columns, strict=True), _image_row(rings)]
    marks.table(sheet.panel("d", "(d) angles on the circles"), rows)
    return sheet


def aligned_circles(sheet: Sheet, key: str, rings: RingPair) -> None:
    """Draw Q's circle, and P's rotated onto it, in a panel."""
    axes = sheet.panel(key, f"({key}) P's circle rotated by {degrees(rings.turn)}, on Q's")
    marks.unit_circle_frame(axes)
    for ring, angle in ((rings.q, 0.0), (rings.p, rings.turn)):
        letter, tint = ring.side.letter, marks.TINTS[ring.side.letter]
        circle = ring.circle
        boundary, image = (marks.rotated(xy, angle) for xy in (circle.boundary, circle.image))
        marks.line(axes, marks.closed(boundary), tint.mark, marks.OUTLINE)
        for point in boundary:
            marks.line(axes, [image, point], tint.mark, marks.SPOKE)
        for points in (boundary, image):
            marks.dots(axes, points, tint, marks.STACKED_DOT[letter], hollow=letter == "Q")
    boundary = rings.q.circle.boundary[rings.partner]
    marks.circle_names(axes, boundary, rings.names, marks.label_size(rings.q))


def _image_row(rings: RingPair) -> list[str]:
    """Return the row of the table for the directions of the centres' images from the middle."""
    if rings.image_rotation is None:
        return ["$c_p$ $c_q$", "none", "none", "", ""]
    of_p, of_q = (math.atan2(*ring.circle.image[::-1]) for ring in (rings.p, rings.q))
    off = math.remainder(of_q - of_p - rings.turn, 2 * math.pi)
    directions = map(positive_degrees, (of_p, of_q, of_q - of_p))
    return ["$c_p$ $c_q$", *directions, degrees(off)]


def rotation(pair: PointPair, rings: RingPair) -> Sheet:
    """Draw the second page: the rings, their circles aligned with them, and the sets overlaid."""
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
    sheet = Sheet(title, caption, ["ab", "cd", "ef"], (292, 322, 342))
    for ring, (plane, circle) in zip((p, q), (("a", "c"), ("b", "d")), strict=True):
        letter = ring.side.letter
        axes = sheet.panel(plane, f"({plane}) {letter}: the ring of point {ring.centre}")
        marks.ring_in_mesh(axes, ring, ROOM, PALE_MESH)
        axes = sheet.panel(circle, f"({circle}) {letter}: its unit circle, aligned with it")
        _aligned_circle(axes, rings, ring)
    axes = sheet.panel("e", f"(e) P aligned with Q: {share} match")
    moved, onto = rings.move.apply(pair.p.mesh.points), pair.q.mesh.points
    pixel = show(axes, np.vstack([moved, onto]), EDGE_ROOM)
    marks.mesh_lines(axes, pair.q.mesh, PALE_MESH)
    matched_dots(axes, moved, onto, matched, crowding(pair.q, pixel), marks.EDGE)
    images = "none" if rings.image_rotation is None else degrees(rings.image_rotation)
    rows = [
        ["", "rotation", "scale"],
        [pair.transform_name, *_rotation_and_scale(pair.transform)],
        ["rings, least squares", *_rotation_and_scale(rings.transform)],
        ["unit circles", degrees(rings.circle_rotation), ""],
        ["$c_p$ to $c_q$", images, ""],
    ]
    axes = sheet.panel("f", "(f) the transform from P to Q")
    marks.table(axes, rows, first=NAMES_WIDTH, sums=False)
    return sheet


def matched_points(pair: PointPair, rings: RingPair) -> NDArray[np.int32]:
    """Return the pairs (K, 2) of points that match under the transform of one pair of rings."""
    tolerance = PAPER.precision * pair.q.prepared.spacing
    return greedy_pairs(rings.move.apply(pair.p.mesh.points), pair.q.mesh.points, tolerance)


def matched_dots(
    axes: Axes, moved: Floats, q: Floats, pairs: NDArray[np.int32], size: float, link: float
) -> None:
    """Draw the points of Q, those of P moved, full where they have a partner, and the links.

    `size` is relative to other figures, `link` the width of the links.
    """
    p_dot, q_dot = (size * marks.STACKED_DOT[letter] for letter in "PQ")
    i, j = pairs.T
    marks.dots(axes, q, marks.TINTS["Q"], q_dot, hollow=True)
    marks.segments(axes, np.stack([moved[i], q[j]], axis=1), PAIR_LINK, link)
    marks.dots(axes, moved[i], marks.TINTS["P"], p_dot)
    marks.dots(axes, np.delete(moved, i, axis=0), marks.TINTS["P"], p_dot, hollow=True)


def _rotation_and_scale(transform: Similarity) -> tuple[str, str]:
    angle = math.remainder(transform.rotation, 2 * math.pi)
    return degrees(angle), significant(transform.scale)


def _aligned_circle(axes: Axes, rings: RingPair, ring: Ring) -> None:
    """Draw a circle aligned with its ring; in Q's, the angle from P's image to its own."""
    avoid = [MIDDLE]
    image = marks.rotated(ring.circle.image, ring.orientation)
    if ring is rings.q and rings.image_rotation is not None:
        avoid.append(_angle_between_images(axes, rings, image, rings.image_rotation))
    marks.circle_ring(axes, ring, ring.orientation, avoid)
    marks.line(axes, [MIDDLE, image], TEXT, marks.OUTLINE)


def _angle_between_images(axes: Axes, rings: RingPair, c_q: Floats, between: float) -> Floats:
    """Draw P's image and the arc from it to Q's; return the place of the angle's label."""
    c_p = marks.rotated(rings.p.circle.image, rings.p.orientation)
    start = math.atan2(c_p[1], c_p[0])
    radius = max(LEAST_ARC_RADIUS, ARC_RADIUS * min(math.hypot(*c_p), math.hypot(*c_q)))
    along = start + np.linspace(0.0, between, ARC_STEPS)
    marks.line(axes, [MIDDLE, c_p], marks.TINTS["P"].mark, marks.OUTLINE, "--")
    marks.line(axes, radius * np.column_stack([np.cos(along), np.sin(along)]), TEXT, marks.EDGE)
    marks.dots(axes, c_p, marks.TINTS["P"], marks.STACKED_DOT["P"])
    half = start + between / 2
    outward = np.array([math.cos(half), math.sin(half)])
    marks.label(axes, radius * outward, degrees(between), away=outward, distance=ARC_DISTANCE)
    return (radius + ANGLE_DEPTH) * outward

"""The paper's Figures 2 and 3: the sets, their triangulations, and one-rings in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.drawing.paper_figures import marks
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.scene.palette import TEXT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fpmatch.drawing.paper_figures.pair import PointPair, PointSide
    from fpmatch.drawing.paper_figures.rings import RingPair

KEYS: Final = (("a", "b"), ("c", "d"))  # of the panels
HEIGHTS: Final = (322, 322)
EDGE_ROOM, NAME_ROOM = 18.0, 36.0  # pixels around a set, and around a ring and its names
LARGEST_DOT: Final = 7.0
FREE_SPACING: Final = 20.0  # pixels between points that need not be drawn smaller
LEAST_CROWDING: Final = 0.3


def triangulations(pair: PointPair) -> Sheet:
    """Draw Figure 2: both sets, as points and triangulated."""
    caption = (
        f"{pair.origin} Each set is triangulated by Delaunay's criterion: no circle through the "
        "corners of a triangle contains another point. "
        f"P: {_counts(pair.p)}. Q: {_counts(pair.q)}. x points right, y "
        f"{'down, as in images' if pair.y_down else 'up'}; each panel has its own scale."
    )
    sheet = Sheet("Figure 2. The triangulations", caption, KEYS, HEIGHTS)
    for side, (raw, meshed) in zip((pair.p, pair.q), KEYS, strict=True):
        axes = sheet.panel(raw, f"({raw}) {side.letter}: points as given")
        _points(axes, side, show(axes, side.mesh.points, EDGE_ROOM))
        axes = sheet.panel(meshed, f"({meshed}) {side.letter}: triangulated")
        _meshed(axes, side)
    return sheet


def one_rings(rings: RingPair) -> Sheet:
    """Draw Figure 3: the rings that correspond, in their triangulations and enlarged."""
    p, q = rings.p, rings.q
    caption = (
        f"A point inside the triangulation has a closed one-ring: the polygon of its neighbours. "
        f"Shaded: point {p.centre} of P with its {len(p)} neighbours, and its partner, "
        f"point {q.centre} of Q. Points of a ring are numbered counter-clockwise from an arbitrary "
        "first one, so that numbers in P and Q differ."
    )
    sheet = Sheet("Figure 3. One-rings", caption, KEYS, HEIGHTS)
    for ring, (whole, part) in zip((p, q), KEYS, strict=True):
        side = ring.side
        near = sheet.panel(part, f"({part}) the frame of ({whole}), enlarged")
        _points(near, side, show(near, ring.points, NAME_ROOM))
        marks.ring_in_mesh(near, ring, NAME_ROOM)
        far = sheet.panel(whole, f"({whole}) {side.letter}: one-ring of point {ring.centre}")
        _meshed(far, side)
        marks.polygon(far, ring.points, marks.TINTS[side.letter])
        marks.dots(far, ring.middle, marks.TINTS[side.letter], marks.CENTRE_DOT, hollow=True)
        (x0, x1), (y0, y1) = near.get_xlim(), near.get_ylim()
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
        marks.line(far, corners, TEXT, marks.EDGE, "--")
        far.lines[-1].set_zorder(marks.DOTS + 1)  # above the points of a crowded set
    return sheet


def _meshed(axes: Axes, side: PointSide) -> None:
    pixel = show(axes, side.mesh.points, EDGE_ROOM)
    marks.mesh_lines(axes, side.mesh)
    _points(axes, side, pixel)


def _points(axes: Axes, side: PointSide, pixel: float) -> None:
    marks.dots(
        axes, side.mesh.points, marks.TINTS[side.letter], LARGEST_DOT * crowding(side, pixel)
    )


def crowding(side: PointSide, pixel: float) -> float:
    """Return the factor for the size of points, less than 1 where they are close.

    `pixel` is the length of a pixel in the set's frame.
    """
    spacing = side.prepared.spacing / pixel
    return min(1.0, max(LEAST_CROWDING, spacing / FREE_SPACING))


def _counts(side: PointSide) -> str:
    mesh = side.mesh
    return (
        f"{len(mesh)} points, {len(mesh.edges)} edges, {len(mesh.triangles)} triangles, "
        f"{len(mesh.hull)} points on the convex hull, {int(mesh.interior.sum())} closed one-rings"
    )

"""The paper's Figures 2 and 3: the sets, their triangulations, and one-rings picked out of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.drawing.palette import TEXT
from fpmatch.drawing.paper_figures.marks import (
    CENTRE_DOT,
    EDGE,
    FRAMES,
    TINTS,
    dots,
    line,
    mesh_lines,
    polygon,
    ring_lines,
    ring_names,
)
from fpmatch.drawing.paper_figures.sheet import Sheet, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fpmatch.drawing.paper_figures.pair import PointPair, PointSide
    from fpmatch.drawing.paper_figures.ring import RingPair
    from fpmatch.pointset.delaunay.triangulation import Triangulation

PANEL_HEIGHT: Final = 330
EDGE_ROOM: Final = 18.0  # pixels around a set
NAME_ROOM: Final = 36.0  # pixels around a ring, for its names
LARGEST_DOT: Final = 7.0
FREE_SPACING: Final = 20.0  # pixels between points that need not be drawn smaller
LEAST_CROWDING: Final = 0.3


def triangulations(pair: PointPair) -> Sheet:
    """Draw Figure 2: both sets, as points and triangulated."""
    caption = (
        f"{pair.origin} Each set is triangulated by Delaunay's criterion: no circle through the "
        "corners of a triangle holds another point. "
        f"P: {_count(pair.p)}. Q: {_count(pair.q)}. x points right, y "
        f"{'down, as in images' if pair.y_down else 'up'}; each panel has its own scale."
    )
    sheet = Sheet("Figure 2. The triangulations", caption, 2, [PANEL_HEIGHT, PANEL_HEIGHT])
    for row, side in enumerate((pair.p, pair.q)):
        raw, meshed = "ac"[row], "bd"[row]
        axes = sheet.panel(row, 0, f"({raw}) {side.letter}: points as given")
        pixel = show(axes, side.mesh.points, EDGE_ROOM)
        _points(axes, side, pixel)
        axes = sheet.panel(row, 1, f"({meshed}) {side.letter}: triangulated")
        show(axes, side.mesh.points, EDGE_ROOM)
        mesh_lines(axes, side.mesh)
        _points(axes, side, pixel)
    return sheet


def one_rings(pair: PointPair, rings: RingPair) -> Sheet:
    """Draw Figure 3: the rings that correspond, in their triangulations and by themselves."""
    p, q = rings.p, rings.q
    caption = (
        f"A point inside the triangulation has a closed one-ring: the polygon of its neighbours. "
        f"Shaded: point {p.centre} of P with its {len(p)} neighbours, and its partner, "
        f"point {q.centre} of Q. Points of a ring are numbered counter-clockwise, from wherever "
        f"their list begins, so that numbers in P and Q differ."
    )
    sheet = Sheet("Figure 3. One-rings", caption, 2, [PANEL_HEIGHT, PANEL_HEIGHT])
    for row, ring in enumerate((p, q)):
        side = ring.side
        tint, (whole, part) = TINTS[side.letter], ("ab", "cd")[row]
        near = sheet.panel(row, 1, f"({part}) the frame of ({whole}), enlarged")
        pixel = show(near, ring.points, NAME_ROOM)
        mesh_lines(near, side.mesh)
        _points(near, side, pixel)
        ring_lines(near, ring)
        ring_names(near, ring, in_mesh=True)
        far = sheet.panel(row, 0, f"({whole}) {side.letter}: one-ring of point {ring.centre}")
        pixel = show(far, side.mesh.points, EDGE_ROOM)
        mesh_lines(far, side.mesh)
        _points(far, side, pixel)
        polygon(far, ring.points, tint)
        dots(far, ring.middle, tint, CENTRE_DOT, hollow=True)
        _frame(far, (near.get_xlim(), near.get_ylim()))
    return sheet


def _points(axes: Axes, side: PointSide, pixel: float) -> None:
    """Draw all points, smaller where they stand close."""
    dots(axes, side.mesh.points, TINTS[side.letter], LARGEST_DOT * crowding(side, pixel))


def crowding(side: PointSide, pixel: float) -> float:
    """Return by how much points are to be drawn smaller, `pixel` long in the set's frame."""
    spacing = side.prepared.spacing / pixel
    return min(1.0, max(LEAST_CROWDING, spacing / FREE_SPACING))


def _frame(axes: Axes, window: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Draw the part of the plane that is enlarged beside."""
    (x0, x1), (y0, y1) = window
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    line(axes, corners, TEXT, EDGE, dashed=True, layer=FRAMES)


def _count(side: PointSide) -> str:
    """Say how many points, edges, triangles and closed rings a set has."""
    mesh: Triangulation = side.mesh
    return (
        f"{len(mesh)} points, {len(mesh.edges)} edges, {len(mesh.triangles)} triangles, "
        f"{len(mesh.hull)} points on the convex hull, {int(mesh.interior.sum())} closed one-rings"
    )

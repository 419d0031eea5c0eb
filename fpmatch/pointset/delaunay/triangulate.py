"""Delaunay triangulation of any finite point set, with the one-ring of every point.

The paper (section 3.1) takes its neighbourhoods from the triangulation, by Leach's divide and
conquer (its [6]), and so does this module. Minutiae have whole coordinates in pixels, so that
coincident, collinear and co-circular points are common; each case has its rule:

- *coincident points*: the first stands for the rest; each of the others is joined to it by an
  edge, has it as its only neighbour, and is not part of the triangulation (where all points
  coincide, they are the first one's neighbours too);
- *all points on one line* (flatter than 1e-9 of their extent): edges join consecutive points,
  there are no triangles;
- *co-circular points*: the convex polygon that they span is fanned out from its smallest vertex
  (smallest x, then smallest y). This is what an infinitely small lowering of the points on the
  paraboloid x² + y² would yield, each by far more than the next larger one, so the rule never
  contradicts itself.

Coordinates are first rounded to one part in 2^52 of the extent, which leaves whole pixels
unchanged; points nearer than that coincide. On these numbers every predicate is exact. The points
are sorted by x, then y, so the triangulation does not depend on their order, except for which of
coincident points stands for the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.pointset.delaunay._delaunay_kernel import link_points
from fpmatch.pointset.delaunay._mesh_arrays_kernel import collect_arrays
from fpmatch.pointset.delaunay._point_order_kernel import sort_points
from fpmatch.pointset.geometry.points import as_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Ints = NDArray[np.int64]
    Plane = NDArray[np.complex128]  # points as x + iy

GRID_BITS: Final = 52
"""Coordinates are triangulated to 2**-52 of the extent: float64's own precision."""

FLATNESS: Final = 1e-9
"""Width over extent below which points count as lying on one line."""


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """A Delaunay triangulation of N points and its one-rings.

    Counter-clockwise means the mathematical sense in the coordinates as they stand: from +x
    towards +y (with y pointing down, that is clockwise on screen).

    The one-ring of point i is ``ring[ring_start[i]:ring_start[i + 1]]``.
    """

    points: NDArray[np.float64]  # (N, 2)
    triangles: NDArray[np.int32]  # (T, 3): corners, counter-clockwise
    edges: NDArray[np.int32]  # (E, 2): joined points, the smaller index first
    # (H,): points on the outer boundary, counter-clockwise from the smallest (x, then y); all of
    # them in order along the line where the points are collinear or coincide
    hull: NDArray[np.int32]
    ring_start: NDArray[np.int32]  # (N + 1,): where the one-ring of each point begins
    ring: NDArray[np.int32]  # neighbours of each point, counter-clockwise by direction, from -π on
    interior: NDArray[np.bool_]  # (N,): whether the one-ring is a closed polygon around the point

    def __len__(self) -> int:
        return len(self.points)

    def one_ring(self, i: int) -> NDArray[np.int32]:
        """Return the neighbours of point `i`, counter-clockwise."""
        return self.ring[self.ring_start[i] : self.ring_start[i + 1]]


def triangulate(points: ArrayLike) -> Triangulation:
    """Triangulate finite `points` (N, 2) by Delaunay's criterion, whatever their position.

    No circle through the corners of a triangle holds another point inside; the tie rules are those
    of this module's docstring.
    """
    return triangulate_checked(as_points(points))


def triangulate_checked(given: NDArray[np.float64]) -> Triangulation:
    """Triangulate points that `as_points` returned; they are made read-only. See `triangulate`."""
    in_order = sort_points(given, FLATNESS)
    given.setflags(write=False)
    if in_order is None:
        return triangulate_collinear(given, GRID_BITS)
    xy, distinct, order = in_order
    links = link_points(xy, distinct)
    return Triangulation(given, *collect_arrays(xy, distinct, order, links))


def triangulate_collinear(points: NDArray[np.float64], grid_bits: int) -> Triangulation:
    """Join each of finite points (N, 2) on one line to the next along it.

    Points that are equal to 2**-grid_bits of the extent coincide: the first stands for the rest,
    and each of the others is joined to it alone.
    """
    from fpmatch.pointset.geometry.frames import UnitFrame  # noqa: PLC0415  (else not needed)

    n = len(points)
    steps = np.rint(np.ldexp(UnitFrame.of(points).apply(points), grid_bits))
    z = np.ldexp(steps, -grid_bits).view(np.complex128).ravel()
    _, distinct, place = np.unique(z, return_index=True, return_inverse=True)
    by_place, stand_in = z.argsort(kind="stable"), distinct[place]
    twins = by_place[stand_in[by_place] != by_place]
    repeats = np.column_stack([stand_in[twins], twins])
    line = _order_on_line(z, distinct)
    path = np.column_stack([line[:-1], line[1:]])
    start, end = np.vstack([path, path[:, ::-1], repeats[:, ::-1]]).T
    if len(distinct) == 1:  # then the others are neighbours of the first as well
        start, end = np.vstack([repeats, repeats[:, ::-1]]).T
        line = np.arange(n)
    order = np.lexsort((np.angle(z[end] - z[start]), start))
    arrays = (
        np.empty((0, 3), np.int32),
        np.sort(np.vstack([path, repeats]), axis=1).astype(np.int32),
        line.astype(np.int32),
        np.bincount(start + 1, minlength=n + 1).cumsum().astype(np.int32),
        end[order].astype(np.int32),
        np.zeros(n, np.bool_),
    )
    for array in arrays:
        array.setflags(write=False)
    return Triangulation(points, *arrays)


def _order_on_line(z: Plane, points: Ints) -> Ints:
    """Return `points` in their order along the line through the first and the furthest from it."""
    if len(points) < 2:
        return points
    offset = z[points] - z[points[0]]
    axis = offset[np.abs(offset).argmax()]
    return np.asarray(points[(offset * axis.conjugate()).real.argsort(kind="stable")])

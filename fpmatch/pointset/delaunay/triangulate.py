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

from typing import TYPE_CHECKING, Final

from fpmatch.pointset.delaunay._delaunay_kernel import link_points
from fpmatch.pointset.delaunay._mesh_arrays_kernel import collect_arrays
from fpmatch.pointset.delaunay._point_order_kernel import sort_points
from fpmatch.pointset.delaunay.triangulation import Triangulation
from fpmatch.pointset.geometry.points import as_points

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

GRID_BITS: Final = 52
"""Coordinates are triangulated to 2**-52 of the extent: float64's own precision."""

FLATNESS: Final = 1e-9
"""Width over extent below which points count as lying on one line."""


def triangulate(points: ArrayLike) -> Triangulation:
    """Triangulate `points` by Delaunay's criterion, whatever their position.

    No circle through the corners of a triangle holds another point inside; the tie rules are
    those of this module's docstring. Points that are not finite or not of shape (N, 2) are refused
    with a `PointSetError`.

    Examples
    --------
    >>> mesh = triangulate([[0, 0], [4, 0], [4, 4], [0, 4], [2, 1]])
    >>> mesh.one_ring(4).tolist(), mesh.interior.tolist()
    ([0, 1, 2, 3], [False, False, False, False, True])
    """
    return triangulate_checked(as_points(points))


def triangulate_checked(given: NDArray[np.float64]) -> Triangulation:
    """Triangulate points that `as_points` returned; they are made read-only. See `triangulate`."""
    in_order = sort_points(given, FLATNESS)
    given.setflags(write=False)
    if in_order is None:
        from fpmatch.pointset.delaunay.collinear import triangulate_collinear  # noqa: PLC0415

        return triangulate_collinear(given, GRID_BITS)
    xy, distinct, order = in_order
    links = link_points(xy, distinct)
    return Triangulation(given, *collect_arrays(xy, distinct, order, links))

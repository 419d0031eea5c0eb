"""Triangles with their shapes: those of a triangulation, and those of one-rings with gaps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.points.triangles._proposal_kernel import describe_triangles
from fpmatch.pointset.geometry.points import sort_into_cells

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.geometry._grid_kernel import CellGrid

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

_LEFT: Final = -0.1  # shapes may lie outside 0..1 where a side is only nearly the longest
_RIGHT: Final = 1.1
_HIGH: Final = 1.0
_NARROWEST_BIN: Final = 0.02
_WIDEST_BIN: Final = 0.2
_MEDIAN_AREA: Final = 0.377  # of the Delaunay triangles of random points, one a unit of area
_ALIKE: Final = 1.005  # squared distances of a run
# A run of as many, this share of all and six deviations more is not of random points.
_RUN, _RUN_SHARE = 6.0, 0.0018
_SHARES: Final = (0.25, 0.5, 0.75, 0.9)
_LOG_MIDDLE: Final = 1.5725  # ln(ln(1 - .75) / ln(1 - .25)): squared distances are exponential
_LOG_UPPER: Final = 1.2006  # ln(ln(1 - .9) / ln(1 - .5))
_MIDDLE: Final = (-7.0, 9.5)  # times the root of the number: beyond is one in 1,000 random sets
_UPPER: Final = (-5.5, 7.5)
_CROWDED: Final = 0.2  # more than over the hull,
_CROWDED_FEW: Final = 2.5  # or so much by the root of the number
_RING_REACH: Final = 8  # positions in a ring: more than half of nearly every one
_FEW: Final = 64  # of fewer points it is not known whether they are even


class TriangleDescriptors(NamedTuple):
    """Triangles described by their longest sides; the first `number` entries count."""

    number: int
    corner: Ints  # (C, 3): ends of the longest side and the apex, counter-clockwise
    shape: Floats  # (2, C): the apex in the complex plane, that side mapped to 0..1
    side: Floats  # (C,): length of that side
    # (C,): minus the value of a match times the probability that the triangle exists in the other
    # set; (0,) where it was not computed
    negative_information: Floats


def ring_triangles(mesh: Triangulation, points: Floats) -> Ints:
    """Return all triangles (T, 3) of a point and two of its neighbours, each once.

    They are Delaunay triangles of the set without some of its points. Of a large ring the two are
    near each other. `points` (2, N) are those of the mesh, here and below; corners are
    counter-clockwise, and flat triangles are left out.
    """
    begin, degree = mesh.ring_start[:-1], np.diff(mesh.ring_start)
    owner = np.repeat(np.arange(len(mesh), dtype=np.int32), degree)
    place = np.arange(len(owner)) - begin[owner]
    made = []
    for apart in range(1, _RING_REACH + 1):
        here = np.flatnonzero(2 * apart <= degree[owner])
        of = owner[here]
        beyond = begin[of] + (place[here] + apart) % degree[of]
        made.append(np.column_stack([of, mesh.ring[here], mesh.ring[beyond]]))
    corners = np.sort(np.vstack(made), axis=1)
    corners = corners[np.lexsort(corners.T)]
    repeats = (corners[1:] == corners[:-1]).all(axis=1)
    corners = corners[~np.append(False, repeats)]
    area = triangle_areas(points, corners)
    clockwise = area < 0.0
    corners[clockwise] = corners[clockwise][:, [0, 2, 1]]
    return np.ascontiguousarray(corners[area != 0.0])


def triangle_areas(points: Floats, triangles: Ints) -> Floats:
    """Return the area (T,) of each triangle, positive where its corners are counter-clockwise."""
    (x, y), (a, b, c) = points, triangles.T
    return np.asarray(0.5 * ((x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])))


def density_over_hull(mesh: Triangulation, points: Floats) -> float:
    """Return points to a unit of area of the convex hull."""
    x, y = points[:, mesh.hull] - points[:, mesh.hull[:1]]
    return len(mesh) / float(0.5 * (x[:-1] @ y[1:] - y[:-1] @ x[1:]))


def density_of(mesh: Triangulation, points: Floats) -> float:
    """Return the larger of the densities over the convex hull and over the median triangle.

    The hull of clustered points, or of points with an outlier, is much larger than the area that
    most of them cover.
    """
    area = triangle_areas(points, mesh.triangles)
    middle = len(area) // 2
    area.partition(middle)
    over_hull = density_over_hull(mesh, points)
    return max(over_hull, _MEDIAN_AREA / float(area[middle])) if area[middle] > 0 else over_hull


def nearest_two(mesh: Triangulation, points: Floats) -> tuple[Floats, Floats]:
    """Return the squared distances (N,) of each point to its two nearest neighbours in the mesh.

    Where points coincide, one may have a single neighbour: the second is infinitely far then.
    """
    degree, begin = np.diff(mesh.ring_start), mesh.ring_start[:-1]
    x, y = points[:, mesh.ring] - np.repeat(points, degree, axis=1)
    squared = x * x + y * y
    first = np.minimum.reduceat(squared, begin)
    nearest = np.flatnonzero(squared == np.repeat(first, degree))
    owner = np.searchsorted(begin, nearest, "right")
    squared[nearest[np.append(True, owner[1:] != owner[:-1])]] = np.inf
    return first, np.minimum.reduceat(squared, begin)


def is_even(mesh: Triangulation, points: Floats, density: float) -> bool:
    """Return whether nearest distances are distributed as those of random points of a density.

    Then there is no need to look for rows, periods and crowds: they have too many equal distances,
    or too many short or long ones. Of few points it is not known.
    """
    n = len(mesh)
    root = math.sqrt(n)
    crowded = 1.0 + max(_CROWDED, _CROWDED_FEW / root)
    if n < _FEW or density > crowded * density_over_hull(mesh, points):
        return False
    ordered = np.sort(nearest_two(mesh, points)[0])
    quarter, half, most, nearly_all = (float(ordered[int(share * n)]) for share in _SHARES)
    if quarter <= 0.0:
        return False
    middle = root * (math.log(most / quarter) - _LOG_MIDDLE)
    upper = root * (math.log(nearly_all / half) - _LOG_UPPER)
    if not (_MIDDLE[0] < middle < _MIDDLE[1] and _UPPER[0] < upper < _UPPER[1]):
        return False
    ends = ordered.searchsorted(_ALIKE * ordered, "right")
    usual = _RUN_SHARE * n
    return bool((ends - np.arange(n)).max() < _RUN + usual + 6 * math.sqrt(usual))


def describe(
    points: Floats,
    triangles: Ints,
    *,
    near_tie: float = 1.0,
    shortest: float = 0.0,
    outliers: float | None = None,
) -> TriangleDescriptors:
    """Describe each triangle by its sides of `near_tie` times the longest or more.

    Sides under the length `shortest` are left out. With `outliers`, points without a partner to a
    unit of area, which may split a triangle, the information is computed.
    """
    most = 3 * len(triangles)
    corner, shape, side = np.empty((most, 3), np.int32), np.empty((2, most)), np.empty(most)
    arrays = corner, shape, side, np.empty(0 if outliers is None else most)
    number = describe_triangles(points, triangles, near_tie, shortest, outliers or 0.0, *arrays)
    return TriangleDescriptors(number, *arrays)


def sort_by_shape(triangles: TriangleDescriptors, widest: float) -> CellGrid:
    """Return the shapes of triangles in a grid; `widest` is the largest distance of a search."""
    width = min(max(widest / 2, _NARROWEST_BIN), _WIDEST_BIN)
    return sort_into_cells(
        triangles.shape, width, low=(_LEFT, 0.0), high=(_RIGHT, _HIGH), count=triangles.number
    )

"""Sets as given to a matcher, their densities and triangles, and the set Q that P is overlaid on.

Triangles are those of a triangulation, and those of one-rings with gaps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.lab.points.triangles._proposal_kernel import describe_triangles
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.geometry.frames import UnitFrame, frame_of
from fpmatch.pointset.geometry.points import LARGEST, as_points, sort_into_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.geometry._grid_kernel import CellGrid

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MIN_POINTS: Final = 3
"""Any two points can be mapped to any two others: smaller sets are refused."""

REACHES: Final = 4.0 ** -np.arange(8)
"""Shares of t² at which pairs are counted: within t, t/2, t/4 and so on."""

_LEAST_EXTENT: Final = 2.0**-60  # and its inverse: fourth powers of lengths stay in float64
_TOLERANCE: Final = 0.25  # of a pair, by default, in spacings
_SECOND_NEAREST: Final = 0.731  # spacings: median distance of random points
_WIDEST_TOLERANCE: Final = 0.6  # mean spacings: beyond, a point finds a partner anywhere
# Grid of the shapes of triangles.
_LEFT: Final = -0.1  # shapes may lie outside 0..1 where a side is only nearly the longest
_RIGHT: Final = 1.1
_HIGH: Final = 1.0
_NARROWEST_BIN: Final = 0.02
_WIDEST_BIN: Final = 0.2
# Densities, and what random points of one have.
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


class GivenSet:
    """The distinct points of a set in its frame, triangulated; refused if without a triangle."""

    def __init__(self, name: str, given: ArrayLike) -> None:
        points = as_points(given, name)
        if len(points) < MIN_POINTS:
            raise PointSetError(f"{name}: fewer than three points: {len(points)}")
        extent = np.ptp(points, axis=0).max()
        moderate = extent > _LEAST_EXTENT and np.abs(points).max() < 1 / _LEAST_EXTENT
        self.frame = UnitFrame() if moderate else frame_of(points, name)
        if not moderate:
            points = self.frame.apply(points)
        self.row = np.arange(len(points))  # of each distinct point in the set as given
        self.mesh = triangulate_checked(points)
        if not len(self.mesh.triangles):
            raise PointSetError(f"{name}: all points lie on one line")
        distinct = (len(self.mesh.triangles) + 2 + len(self.mesh.hull)) // 2  # Euler
        if distinct < len(points):
            self.row = np.sort(np.unique(points, axis=0, return_index=True)[1])
            self.mesh = triangulate_checked(points[self.row])
        self.points: Floats = np.array(self.mesh.points.T, order="C")  # (2, N)

    def __len__(self) -> int:
        return len(self.row)


class Target(NamedTuple):
    """The set that another is overlaid on, and how near a pair must be."""

    points: Floats  # (2, N), in the frame of the set
    density: float  # points to a unit of area
    crowding: float  # as a multiple of the density over the convex hull
    spacing: float  # 1/√density, or less where most points lie closer
    rate: Floats  # of partners by chance, at each of `REACHES`
    pairing_tolerance: float  # largest distance of a pair in the result
    tolerance: float  # and in the search, which is never wider than is of use
    grid: CellGrid  # the points, sorted into cells

    @classmethod
    def of(cls, given: GivenSet, tolerance: float | None) -> Target:
        """Prepare a set; `tolerance` is in its own units, by default a quarter of its spacing.

        Without a tolerance, the spacing is also that of random points whose second nearest are
        as far, so that rows and clusters count by the distances that are there.
        """
        points = given.points
        density, crowding = density_of(given.mesh, points)
        spacing = 1.0 / math.sqrt(density)
        if tolerance is None:
            second2 = second_nearest(given.mesh, points)
            second2.partition(len(second2) // 2)
            second = math.sqrt(float(second2[len(second2) // 2]))
            spacing = min(spacing, second / _SECOND_NEAREST)
            pairing = _TOLERANCE * spacing
        else:
            extent = float(np.ptp(points, axis=1).sum())
            pairing = min(math.ldexp(tolerance, -given.frame.exponent), extent)
        t = min(pairing, _WIDEST_TOLERANCE * spacing)
        low, high = points.min(axis=1) - t, points.max(axis=1) + t
        side = max(0.7 * spacing, t)
        grid = sort_into_cells(points, side, low=tuple(low.tolist()), high=tuple(high.tolist()))
        grid.split_crowds()
        rate = -np.expm1(-math.pi * density * t * t * REACHES)
        return cls(points, density, crowding, spacing, rate, pairing, t, grid)


def check_tolerance(tolerance: float | None) -> None:
    """Refuse a tolerance that is not positive and finite with a `PointSetError`."""
    if tolerance is not None and not 0 < tolerance <= LARGEST:
        raise PointSetError(f"tolerance must be positive, not {number_text(tolerance)}")


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
    new = np.ones(len(corners), bool)
    new[1:] = (corners[1:] != corners[:-1]).any(axis=1)
    corners = corners[new]
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


def density_of(mesh: Triangulation, points: Floats) -> tuple[float, float]:
    """Return a density, and how many times that over the convex hull it is, 1 or more.

    It is the larger of the densities over the hull and over the median triangle: the hull of
    clustered points, or of points with an outlier, is much larger than the area that most cover.
    """
    area = triangle_areas(points, mesh.triangles)
    middle = len(area) // 2
    area.partition(middle)
    over_hull = density_over_hull(mesh, points)
    of_median = _MEDIAN_AREA / float(area[middle]) if area[middle] > 0 else 0.0
    density = max(over_hull, of_median)
    return density, density / over_hull


def second_nearest(mesh: Triangulation, points: Floats) -> Floats:
    """Return the squared distances (N,) of each point to its second nearest neighbour in the mesh.

    Where points coincide, one may have a single neighbour: the second is infinitely far then.
    """
    begin, squared = mesh.ring_start[:-1], _squared_distances(mesh, points)
    first = np.minimum.reduceat(squared, begin)
    nearest = np.flatnonzero(squared == np.repeat(first, np.diff(mesh.ring_start)))
    owner = np.searchsorted(begin, nearest, "right")
    squared[nearest[np.append(True, owner[1:] != owner[:-1])]] = np.inf
    return np.asarray(np.minimum.reduceat(squared, begin))


def _squared_distances(mesh: Triangulation, points: Floats) -> Floats:
    """Return those of each point to its neighbours in the mesh, in the order of the rings."""
    x, y = points[:, mesh.ring] - np.repeat(points, np.diff(mesh.ring_start), axis=1)
    return np.asarray(x * x + y * y)


def is_even(mesh: Triangulation, points: Floats, crowding: float) -> bool:
    """Return whether nearest distances are distributed as those of random points of one density.

    Then there is no need to look for rows, periods and crowds: they have too many equal distances,
    or too many short or long ones. Of few points it is not known.
    """
    n = len(mesh)
    root = math.sqrt(n)
    if n < _FEW or crowding > 1.0 + max(_CROWDED, _CROWDED_FEW / root):
        return False
    ordered = np.minimum.reduceat(_squared_distances(mesh, points), mesh.ring_start[:-1])
    ordered.sort()
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

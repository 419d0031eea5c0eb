"""Sets as given to a matcher, and the set Q that P is overlaid on."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.lab.points.triangles import _overlay_kernel as overlay
from fpmatch.lab.points.triangles.descriptors import density_of, nearest_two
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.geometry.frames import UnitFrame, frame_of
from fpmatch.pointset.geometry.points import is_finite, points_in_box, sort_into_cells

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.geometry._grid_kernel import CellGrid
    from fpmatch.pointset.geometry.point_match import PointMatch

    Floats = NDArray[np.float64]

MIN_POINTS: Final = 3
"""Any two points can be mapped to any two others: smaller sets are refused."""

REACHES: Final = 8
"""At which pairs are counted, each half the one before."""

_LEAST_EXTENT: Final = 2.0**-60  # and its inverse: fourth powers of lengths stay in float64
_TOLERANCE: Final = 0.25  # of a pair, by default, in spacings
_SECOND_NEAREST: Final = 0.731  # spacings: median distance of random points
_WIDEST_TOLERANCE: Final = 0.6  # mean spacings: beyond, a point finds a partner anywhere


class GivenSet:
    """A set as given, in its frame and triangulated; one without a triangle is refused by name."""

    def __init__(self, name: str, given: ArrayLike) -> None:
        points, box = points_in_box(given, name)
        if len(points) < MIN_POINTS:
            raise PointSetError(f"{name}: fewer than three points: {len(points)}")
        self.name, self.given = name, points
        left, right, top, bottom = box
        moderate = max(-left, right, -top, bottom) < 1 / _LEAST_EXTENT
        moderate &= max(right - left, bottom - top) > _LEAST_EXTENT
        self.frame = UnitFrame() if moderate else frame_of(points, name)
        if not moderate:
            points, box = points_in_box(self.frame.apply(points), name)
        self.box = box
        self.mesh = triangulate_checked(points)
        if not len(self.mesh.triangles):
            raise PointSetError(f"{name}: all points lie on one line")

    def __len__(self) -> int:
        return len(self.given)


class Target(NamedTuple):
    """The set that another is overlaid on, and how near a pair must be."""

    points: Floats  # (2, N), in the frame of the set
    density: float  # points to a unit of area
    spacing: float  # 1/√density, or less where most points lie closer
    rate: Floats  # (REACHES,): of partners by chance, at the tolerance, half of it and so on
    pairing_tolerance: float  # largest distance of a pair in the result
    tolerance: float  # and in the search, which is never wider than is of use
    grid: CellGrid  # the points, sorted into cells

    @classmethod
    def of(cls, given: GivenSet, tolerance: float | None) -> Target:
        """Prepare a set; `tolerance` is in its own units, by default a quarter of its spacing.

        Without a tolerance, the spacing is also that of random points whose second nearest are
        as far, so that rows and clusters count by the distances that are there.
        """
        points = np.array(given.mesh.points.T, order="C")
        density = density_of(given.mesh, points)
        spacing = 1.0 / math.sqrt(density)
        if tolerance is None:
            second2 = nearest_two(given.mesh, points)[1]
            second2.partition(len(second2) // 2)
            second = math.sqrt(float(second2[len(second2) // 2]))
            spacing = min(spacing, second / _SECOND_NEAREST)
            pairing = _TOLERANCE * spacing
        else:
            pairing = math.ldexp(tolerance, -given.frame.exponent)
        t = min(pairing, _WIDEST_TOLERANCE * spacing)
        left, right, top, bottom = given.box
        low, high = (left - t, top - t), (right + t, bottom + t)
        grid = sort_into_cells(points, max(0.7 * spacing, t), low=low, high=high)
        grid.split_crowds()
        rate = np.empty(REACHES)
        overlay.uniform_rates(density, t * t, rate)
        return cls(points, density, spacing, rate, pairing, t, grid)


def check_tolerance(tolerance: float | None) -> None:
    """Refuse a tolerance that is not positive and finite with a `PointSetError`."""
    if tolerance is not None and not (is_finite(tolerance) and tolerance > 0):
        raise PointSetError(f"tolerance must be positive, not {number_text(tolerance)}")


def match_given(
    p: GivenSet,
    q: GivenSet,
    tolerance: float | None,
    match: Callable[[GivenSet, GivenSet], PointMatch],
) -> PointMatch:
    """Match two sets by `match`: the smaller onto the larger, unless a tolerance in Q is given."""
    if tolerance is None and len(p) > len(q):
        return _match_distinct(q, p, match).inverse()
    return _match_distinct(p, q, match)


def _match_distinct(
    p: GivenSet, q: GivenSet, match: Callable[[GivenSet, GivenSet], PointMatch]
) -> PointMatch:
    """Match two sets by `match`; where points coincide, their distinct points."""
    if not (_has_coincident(p.mesh) or _has_coincident(q.mesh)):
        return match(p, q)
    (distinct_p, index_p), (distinct_q, index_q) = _unique_points(p.given), _unique_points(q.given)
    matched = match(GivenSet(p.name, distinct_p), GivenSet(q.name, distinct_q))
    pairs = _pairs_of_coincident(matched.pairs, index_p, index_q)
    return replace(matched, pairs=pairs, matched_share=len(pairs) / min(len(p), len(q)))


def _has_coincident(mesh: Triangulation) -> bool:
    """Return whether points of a mesh that has triangles coincide."""
    distinct = (len(mesh.triangles) + 2 + len(mesh.hull)) // 2  # Euler
    return distinct < len(mesh)


def _unique_points(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the distinct points of a set (N, 2), and the index of each point among them."""
    distinct, index = np.unique(points, axis=0, return_inverse=True)
    return distinct, index.reshape(-1)


def _pairs_of_coincident(
    pairs: NDArray[np.int32], index_p: NDArray[np.int64], index_q: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Return the pairs of points of two sets whose distinct points have the given `pairs`.

    `index_p` (N,) and `index_q` (M,) hold the index of each point among the distinct ones.
    Coincident points are paired in their order: the first with the first, the second with the
    second. The pairs (L, 2) are sorted by the first.
    """
    to_q = np.full(index_p.max() + 1, -1, np.int64)
    to_q[pairs[:, 0]] = pairs[:, 1]
    most = max(np.bincount(index_p).max(), np.bincount(index_q).max()) + 1
    # key of a point: the distinct point of Q it belongs to, and its number among those there
    partner = to_q[index_p]
    key_p = np.where(partner >= 0, partner * most + _number_of_repeat(index_p), -1)
    key_q = index_q * most + _number_of_repeat(index_q)
    _, in_p, in_q = np.intersect1d(key_p, key_q, return_indices=True)
    paired = np.column_stack([in_p, in_q]).astype(np.int32)
    return paired[paired[:, 0].argsort()]


def _number_of_repeat(index: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many earlier points coincide with each point."""
    order = index.argsort(kind="stable")
    in_order = index[order]
    number = np.empty(len(index), np.int64)
    number[order] = np.arange(len(index)) - in_order.searchsorted(in_order, "left")
    return number

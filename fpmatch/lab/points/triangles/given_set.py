"""Sets as given to a matcher, and the set Q that P is overlaid on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.lab.points.triangles.descriptors import density_of, nearest_two
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.geometry.frames import UnitFrame, frame_of
from fpmatch.pointset.geometry.points import as_points, is_finite, sort_into_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.geometry._grid_kernel import CellGrid

    Floats = NDArray[np.float64]

MIN_POINTS: Final = 3
"""Any two points can be mapped to any two others: smaller sets are refused."""

REACHES: Final = 4.0 ** -np.arange(8)
"""Shares of t² at which pairs are counted: within t, t/2, t/4 and so on."""

_LEAST_EXTENT: Final = 2.0**-60  # and its inverse: fourth powers of lengths stay in float64
_TOLERANCE: Final = 0.25  # of a pair, by default, in spacings
_SECOND_NEAREST: Final = 0.731  # spacings: median distance of random points
_WIDEST_TOLERANCE: Final = 0.6  # mean spacings: beyond, a point finds a partner anywhere


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
        density = density_of(given.mesh, points)
        spacing = 1.0 / math.sqrt(density)
        if tolerance is None:
            second2 = nearest_two(given.mesh, points)[1]
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
        return cls(points, density, spacing, rate, pairing, t, grid)


def check_tolerance(tolerance: float | None) -> None:
    """Refuse a tolerance that is not positive and finite with a `PointSetError`."""
    if tolerance is not None and not (is_finite(tolerance) and tolerance > 0):
        raise PointSetError(f"tolerance must be positive, not {number_text(tolerance)}")

"""The matcher's precomputation: a set triangulated, its one-rings mapped to circles, a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.frames import frame_of
from fpmatch.pointset.grid import sort_into_cells
from fpmatch.pointset.paper.one_rings import OneRings, map_to_unit_circle
from fpmatch.pointset.points import as_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset._grid_kernel import CellGrid
    from fpmatch.pointset.frames import UnitFrame

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedPoints:
    """What matching needs of a point set, whatever the other set."""

    points: Floats  # (N, 2), as given
    frame: UnitFrame  # of the points
    unit: Floats  # (2, N): the points in the frame
    rings: OneRings  # the closed one-rings on the unit circle
    spacing: float  # r/(2√n) of eq. (2) by density: mean nearest-neighbour distance
    grid: CellGrid  # the points in the frame, sorted into cells

    def __len__(self) -> int:
        return len(self.points)


def prepare_points(points: ArrayLike) -> PreparedPoints:
    """Triangulate a set of any finite points (N, 2) and map its one-rings to the unit circle.

    A malformed set, or one with coordinates or extent beyond 2**±300, is refused with a
    `PointSetError`.
    """
    given = as_points(points)
    n = len(given)
    frame = frame_of(given)
    mesh = triangulate(frame.apply(given))
    unit = np.array(mesh.points.T, order="C")
    grid = sort_into_cells(unit, 1.0 / max(1, math.isqrt(n)), low=(0.0, 0.0), high=(1.0, 1.0))
    grid.split_crowds()
    x, y = unit[:, mesh.hull]
    hull_area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    return PreparedPoints(
        points=given,
        frame=frame,
        unit=unit,
        rings=map_to_unit_circle(mesh),
        spacing=0.5 * math.sqrt(hull_area / max(n, 1)),
        grid=grid,
    )

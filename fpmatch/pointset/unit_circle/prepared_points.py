"""The matcher's precomputation: a point set triangulated, mapped to circles, sorted into cells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.frames import frame_of, to_unit_frame
from fpmatch.pointset.grid import sort_into_cells
from fpmatch.pointset.points import as_points
from fpmatch.pointset.unit_circle.one_rings import OneRings, map_to_unit_circle

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset._grid_kernel import CellGrid
    from fpmatch.pointset.points import UnitFrame
    from fpmatch.pointset.similarity import Similarity

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedPoints:
    """Hold a point set made ready for matching: what does not depend on the other set.

    `unit` are the points in `frame`, shape (2, N), `rings` theirs; `spacing` is the mean
    nearest-neighbour distance by density, in the frame; `grid` holds the points in cells.
    """

    points: Floats
    frame: UnitFrame
    unit: Floats
    rings: OneRings
    spacing: float
    grid: CellGrid

    def __len__(self) -> int:
        return len(self.points)

    @property
    def enter_frame(self) -> Similarity:
        """Transform from the points as given into their unit frame."""
        return to_unit_frame(self.frame)

    @property
    def leave_frame(self) -> Similarity:
        """Transform from the unit frame back to the points as given."""
        return self.enter_frame.inverse()


def prepare_points(points: ArrayLike) -> PreparedPoints:
    """Do the precomputation for one set: triangulate it and map its one-rings to the circle.

    Parameters
    ----------
    points : array_like of float, shape (N, 2)
        Any finite points.

    Returns
    -------
    PreparedPoints
        The set, ready for `match_prepared`.

    Raises
    ------
    PointSetError
        If the set is malformed, or its coordinates or extent are beyond 2**±300.

    Examples
    --------
    >>> len(prepare_points([[0, 0], [4, 0], [4, 4], [0, 4], [2, 1]]).rings)
    1
    """
    given = as_points(points)
    frame = frame_of(given)
    mesh = triangulate(frame.apply(given))
    unit = np.array(mesh.points.T, order="C")
    side = 1.0 / max(1, math.isqrt(len(given)))
    return PreparedPoints(
        points=given,
        frame=frame,
        unit=unit,
        rings=map_to_unit_circle(mesh),
        spacing=_spacing(unit[:, mesh.hull], len(given)),
        grid=sort_into_cells(unit, side, low=(0.0, 0.0), high=(1.0, 1.0)),
    )


def _spacing(hull: Floats, n: int) -> float:
    """Return r/(2√n) of eq. (2) for n points over the area of their hull (2, H)."""
    x, y = hull
    area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    return 0.5 * math.sqrt(area / n) if n else 0.0

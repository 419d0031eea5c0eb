"""All one-rings of a triangulation mapped to the unit circle at once, and sets prepared so."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.frames import frame_of
from fpmatch.pointset.geometry.pairing import index_pairs
from fpmatch.pointset.geometry.points import as_points, sort_into_cells
from fpmatch.pointset.paper import _one_ring_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.geometry._grid_kernel import CellGrid
    from fpmatch.pointset.geometry.frames import UnitFrame

    Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class OneRings:
    """Closed one-rings on the unit circle, ordered by degree and then by area."""

    centre: NDArray[np.int32]  # (R,): the point that each ring encloses
    start: NDArray[np.int32]  # (R + 1,): ring i is ``vertex[start[i]:start[i + 1]]``
    vertex: NDArray[np.int32]  # (M,): points of the rings, counter-clockwise
    circle: NDArray[np.float64]  # (2, M): these on the unit circle (eq. 3), x and y
    weight: NDArray[np.float64]  # (M,): their weights (eq. 4), of sum 1 over a ring
    image: NDArray[np.float64]  # (2, R): the centres' images (eq. 4), x and y
    area: NDArray[np.float64]  # (R,): areas of the inscribed polygons

    def __len__(self) -> int:
        return len(self.centre)

    @property
    def degree(self) -> NDArray[np.int32]:
        """Number of points of each ring."""
        return np.diff(self.start)


def map_to_unit_circle(mesh: Triangulation) -> OneRings:
    """Map the one-ring of every interior point of `mesh` to the unit circle.

    `fpmatch.pointset.paper.parametrize` does the same for one ring. A point that rounding
    puts outside its ring is left out.
    """
    centre = mesh.interior.nonzero()[0].astype(np.int32)
    start, entry = _concatenate(mesh.ring_start[centre], mesh.ring_start[centre + 1])
    vertex = mesh.ring[entry]
    xy = np.array(mesh.points.T, order="C")
    angle, side = _chord_angles(xy, start, vertex)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    weight = np.empty(len(vertex))
    image = np.empty((2, len(centre)))
    kernel.centre_images(xy, centre, start, vertex, circle, weight, image)
    area = _sums(np.sin(side), start) / 2
    inside = (image[0] <= 1).nonzero()[0]
    order = inside[np.lexsort((area[inside], np.diff(start)[inside]))]
    start, entry = _concatenate(start[order], start[order + 1])
    return OneRings(
        centre=centre[order],
        start=start,
        vertex=vertex[entry],
        circle=np.ascontiguousarray(circle[:, entry]),
        weight=weight[entry],
        image=np.ascontiguousarray(image[:, order]),
        area=area[order],
    )


def _concatenate(
    begin: NDArray[np.int32], end: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Concatenate runs begin..end: return where each starts, and the index of each entry."""
    start = np.zeros(len(begin) + 1, np.int32)
    (end - begin).cumsum(out=start[1:])
    return start, index_pairs(begin, end)[1]


def _chord_angles(
    xy: NDArray[np.float64], start: NDArray[np.int32], vertex: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the angle of each ring point on its circle (eq. 3), and that of the side after it."""
    following = np.arange(1, len(vertex) + 1)
    following[start[1:] - 1] = start[:-1]
    x, y = xy[:, vertex]
    side = np.hypot(x[following] - x, y[following] - y)
    length = np.diff(start)
    side *= np.repeat(2 * np.pi / _sums(side, start), length)
    along = side.cumsum() - side
    return along - np.repeat(along[start[:-1]], length), side


def _sums(values: NDArray[np.float64], start: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the sum of `values` over each run (no run is empty)."""
    if len(start) == 1:
        return np.empty(0)
    return np.asarray(np.add.reduceat(values, start[:-1]))


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


def prepare_points(points: ArrayLike, name: str = "points") -> PreparedPoints:
    """Triangulate a set of finite points (N, 2) and map its one-rings to the unit circle."""
    given = as_points(points, name)
    n = len(given)
    frame = frame_of(given, name)
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

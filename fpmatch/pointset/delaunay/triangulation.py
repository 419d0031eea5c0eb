"""A triangulation of points: triangles, edges, hull and one-rings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """A Delaunay triangulation of N points and its one-rings.

    Counter-clockwise means the mathematical sense in the coordinates as they stand: from +x
    towards +y (with y pointing down, that is clockwise on screen).

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        The points.
    triangles : ndarray of int32, shape (T, 3)
        Corners of each triangle, counter-clockwise.
    edges : ndarray of int32, shape (E, 2)
        Joined points, the smaller index first.
    hull : ndarray of int32, shape (H,)
        Points on the outer boundary, counter-clockwise from the smallest (x, then y); all of them
        in order along the line where the points are collinear or coincide.
    ring_start : ndarray of int32, shape (N + 1,)
        The one-ring of point i is ``ring[ring_start[i]:ring_start[i + 1]]``.
    ring : ndarray of int32
        Neighbours of each point in turn, counter-clockwise by direction, from -π on.
    interior : ndarray of bool, shape (N,)
        Whether the one-ring is a closed polygon around the point.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    hull: NDArray[np.int32]
    ring_start: NDArray[np.int32]
    ring: NDArray[np.int32]
    interior: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.points)

    @property
    def has_coincident(self) -> bool:
        """Whether points of a mesh that has triangles coincide."""
        distinct = (len(self.triangles) + 2 + len(self.hull)) // 2  # Euler
        return distinct < len(self)

    def one_ring(self, i: int) -> NDArray[np.int32]:
        """Return the neighbours of point `i`, counter-clockwise."""
        return self.ring[self.ring_start[i] : self.ring_start[i + 1]]

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

    @property
    def has_coincident(self) -> bool:
        """Whether points of a mesh that has triangles coincide."""
        distinct = (len(self.triangles) + 2 + len(self.hull)) // 2  # Euler
        return distinct < len(self)

    def one_ring(self, i: int) -> NDArray[np.int32]:
        """Return the neighbours of point `i`, counter-clockwise."""
        return self.ring[self.ring_start[i] : self.ring_start[i + 1]]

"""Neighbourhoods: what surrounds each minutia on the Delaunay triangulation.

The paper maps the one-ring of a point to the unit circle, its boundary placed by chord length
(eq. 3), its centre a weighted mean of the boundary (eq. 4). So that a neighbourhood is recognised
although neighbours are missing or spurious, the circle is turned until the minutia's direction
points to angle 0, and each neighbour is kept by itself, with its position and direction in that
frame and its shape-preserving weight; points of the second ring make up the number.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import _neighbourhood_kernel as kernel
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.unit_circle._one_ring_kernel import centre_images

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.pointset.delaunay.triangulation import Triangulation


@dataclass(frozen=True, slots=True)
class NeighbourhoodParameters:
    """Set the neighbourhoods; lengths in pixels at 500 dpi.

    A neighbour may lie `tolerance_px`, and `tolerance_per_px` of its own distance, from its
    counterpart.
    """

    size: int = 12  # neighbours of a minutia, nearest first, from its first and second ring
    tolerance_px: float = 9.0
    tolerance_per_px: float = 0.08
    second_ring_weight: float = 0.5  # beyond the one-ring, the least in it; the mean is 1


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhoods:
    """The neighbourhoods of N minutiae as flat arrays.

    In the frame of a minutia its direction is +u. A neighbour has its position u, v, its direction
    c, s, 1/tolerance² and its weight.
    """

    count: NDArray[np.int32]  # (N,): neighbours kept of each minutia
    neighbour: NDArray[np.int32]  # (N, size): which minutiae; beyond the number kept, any
    frame: NDArray[np.float32]  # (N, 6, size): the neighbours in the frame of the minutia


@dataclass(frozen=True, slots=True, eq=False)
class AnchoredRings:
    """The closed one-rings of N minutiae as flat arrays, each on the unit circle.

    That of minutia i has the entries ``start[i]`` to ``start[i + 1]``, counter-clockwise: none
    where it is not closed, on the convex hull. The places on the circle are anchored by the
    direction; the shape-preserving weights sum to 1 over a ring.
    """

    start: NDArray[np.int32]  # (N + 1,)
    ring: NDArray[np.int32]  # (M,): minutiae
    circle: NDArray[np.float64]  # (3, M): x, y and weight


def neighbourhoods(
    points: NDArray[np.float64],
    parameters: NeighbourhoodParameters | None = None,
    start: Sequence[int] | None = None,
) -> Neighbourhoods:
    """Describe the neighbourhood of every minutia; `points` are as `PreparedTemplate` has them.

    They may be those of many prints, each from an entry of `start` up to the next; neighbours are
    numbered from the print's first minutia.
    """
    p = parameters or NeighbourhoodParameters()
    n = points.shape[1]
    starts = (0, n) if start is None else start
    count = np.empty(n, np.int32)
    neighbour = np.zeros((n, p.size), np.int32)
    frame = np.zeros((n, 6, p.size), np.float32)
    most = max((end - first for first, end in pairwise(starts)), default=0)
    writer = kernel.NeighbourhoodWriter(points, p, most, count, neighbour, frame)
    for first, end in pairwise(starts):
        mesh = triangulate_checked(points[:2, first:end].T.copy())
        closed = mesh.interior.view(np.uint8)
        writer.write(first, mesh.edges, mesh.ring_start, mesh.ring, closed)
    return Neighbourhoods(count, neighbour, frame)


def anchored_rings(points: NDArray[np.float64], mesh: Triangulation) -> AnchoredRings:
    """Map the closed one-rings of a mesh to the unit circle, anchored by the direction (Sec. 3)."""
    closed = mesh.interior
    length = mesh.ring_start[1:] - mesh.ring_start[:-1]
    ring = mesh.ring[closed.repeat(length)]
    centre = closed.nonzero()[0].astype(np.int32)
    start = _starts(length[closed])
    circle = np.empty((3, len(ring)))
    image = np.empty((2, len(centre)))
    kernel.map_to_circle(points, centre, start, ring, circle)
    centre_images(points, centre, start, ring, circle, circle[2], image)
    around = image[0] <= 1
    if not around.all():  # rounding has put a point outside its ring
        kept = np.repeat(around, np.diff(start))
        ring, circle = ring[kept], np.ascontiguousarray(circle[:, kept])
        closed = closed.copy()
        closed[centre[~around]] = False
    return AnchoredRings(_starts(length * closed), ring, circle)


def _starts(length: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the starts of consecutive runs of these lengths, and the end of the last one."""
    start = np.zeros(len(length) + 1, np.int32)
    length.cumsum(out=start[1:])
    return start

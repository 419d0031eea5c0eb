"""Neighbourhoods: what surrounds each minutia on the Delaunay triangulation.

The paper maps the one-ring of a point to the unit circle, its boundary placed by chord length
(eq. 3), its centre a weighted mean of the boundary (eq. 4). Two things are added so that a
neighbourhood can be recognised although neighbours are missing or spurious: the circle is turned
so that the minutia's own direction points to angle 0, and each neighbour is kept by itself, with
its position and direction in that frame, so that one that is lost costs its own weight alone.
The shape-preserving weights say how much of the neighbourhood each ring point carries; points of
the second ring make up the number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.pointset.delaunay import triangulate
from fpmatch.pointset.one_rings import map_to_unit_circle

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.one_rings import OneRings
    from fpmatch.pointset.triangulation import Triangulation


@dataclass(frozen=True, slots=True)
class NeighbourhoodParameters:
    """Set the neighbourhoods; lengths in pixels at 500 dpi.

    Parameters
    ----------
    size : int
        Neighbours kept of each minutia, nearest first, from its first and second ring.
    tolerance_px, tolerance_per_px : float
        How far a neighbour may lie from its counterpart: so much, and so much more a pixel of its
        own distance.
    second_ring_weight : float
        Weight of a neighbour beyond the one-ring, and the least of one in it, against a mean of 1.
    """

    size: int = 12
    tolerance_px: float = 9.0
    tolerance_per_px: float = 0.08
    second_ring_weight: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhoods:
    """Hold the neighbourhoods of N minutiae as flat arrays.

    Parameters
    ----------
    count : ndarray of int32, shape (N,)
        Number of neighbours kept of each minutia.
    neighbour : ndarray of int32, shape (N, size)
        Which minutiae they are; beyond the number kept, any.
    frame : ndarray of float32, shape (N, 6, size)
        For each neighbour: position u, v and direction c, s in the minutia's own frame (its
        direction is +u), 1/tolerance², and weight.
    ring_start : ndarray of int32, shape (N + 1,)
        The one-ring of minutia i has the entries ``ring_start[i]`` to ``ring_start[i + 1]``; none
        where it is not closed (on the convex hull).
    ring : ndarray of int32, shape (M,)
        Minutiae of the one-rings, counter-clockwise.
    circle : ndarray of float64, shape (3, M)
        Their places (x, y) on the unit circle, anchored by the direction, and their
        shape-preserving weights, which sum to 1 over a ring.
    """

    count: NDArray[np.int32]
    neighbour: NDArray[np.int32]
    frame: NDArray[np.float32]
    ring_start: NDArray[np.int32]
    ring: NDArray[np.int32]
    circle: NDArray[np.float64]


def neighbourhoods(
    points: NDArray[np.float64], parameters: NeighbourhoodParameters | None = None
) -> Neighbourhoods:
    """Describe the neighbourhood of every minutia.

    Parameters
    ----------
    points : ndarray of float64, shape (4, N)
        x and y in pixels at 500 dpi, y pointing up, and the unit vector of the direction.
    parameters : NeighbourhoodParameters, optional
        Size and tolerances.

    Returns
    -------
    Neighbourhoods
        One for each minutia.
    """
    p = parameters or NeighbourhoodParameters()
    mesh = triangulate(np.ascontiguousarray(points[:2].T))
    rings = map_to_unit_circle(mesh)
    ring_start, ring, circle = _anchored(points, rings)
    importance = _importance(points.shape[1], ring_start, ring, circle[2], p)
    neighbour, count = _nearest_of_two_rings(points, mesh, p.size)
    return Neighbourhoods(
        count=count,
        neighbour=_as_wide(neighbour, p.size),
        frame=_in_own_frames(points, neighbour, count, importance, p),
        ring_start=ring_start,
        ring=ring,
        circle=circle,
    )


def _anchored(
    points: NDArray[np.float64], rings: OneRings
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
    """Return the rings in the order of their centres, their circles turned to the directions.

    The circle is turned so that the place on the boundary where the minutia's direction leaves
    its ring lies at angle 0.
    """
    n = points.shape[1]
    length = np.zeros(n, np.int64)
    length[rings.centre] = rings.degree
    ring_start = np.zeros(n + 1, np.int32)
    np.cumsum(length, out=ring_start[1:])
    ring = np.empty(ring_start[-1], np.int32)
    circle = np.empty((3, len(ring)))
    z = points[0] + 1j * points[1]
    direction = points[2] + 1j * points[3]
    for k, centre in enumerate(rings.centre):
        entries = slice(rings.start[k], rings.start[k + 1])
        vertex = rings.vertex[entries]
        on_circle = rings.circle[0, entries] + 1j * rings.circle[1, entries]
        seen = (z[vertex] - z[centre]) * np.conj(direction[centre])
        turned = on_circle * np.conj(_leaving_point(seen, on_circle))
        here = slice(ring_start[centre], ring_start[centre + 1])
        ring[here] = vertex
        circle[0, here], circle[1, here] = turned.real, turned.imag
        circle[2, here] = rings.weight[entries]
    return ring_start, ring, circle


def _leaving_point(seen: NDArray[np.complex128], on_circle: NDArray[np.complex128]) -> complex:
    """Return the point of the circle that stands for where the +x axis leaves the ring `seen`."""
    k = int(np.argmax(np.mod(np.angle(seen), 2 * np.pi)))
    before, after = seen[k], seen[(k + 1) % len(seen)]
    rise = after.imag - before.imag
    share = -before.imag / rise if rise > 0 else 0.0
    side = np.angle(on_circle[(k + 1) % len(seen)] / on_circle[k]) % (2 * np.pi)
    return complex(on_circle[k] * np.exp(1j * min(max(share, 0.0), 1.0) * side))


def _importance(
    n: int,
    ring_start: NDArray[np.int32],
    ring: NDArray[np.int32],
    weight: NDArray[np.float64],
    p: NeighbourhoodParameters,
) -> NDArray[np.float64]:
    """Return the weight of minutia j as a neighbour of minutia i, shape (N, N), before scaling."""
    importance = np.full((n, n), p.second_ring_weight)
    degree = np.diff(ring_start)
    centre = np.repeat(np.arange(n), degree)
    importance[centre, ring] += (1 - p.second_ring_weight) * weight * degree[centre]
    return importance


def _nearest_of_two_rings(
    points: NDArray[np.float64], mesh: Triangulation, size: int
) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Return each minutia's nearest neighbours in its first two rings, and how many there are."""
    n = points.shape[1]
    joined = np.zeros((n, n), np.float32)
    joined[mesh.edges[:, 0], mesh.edges[:, 1]] = 1
    joined += joined.T
    near = (joined + joined @ joined) > 0
    np.fill_diagonal(near, val=False)
    distance = np.hypot(*(points[:2, :, None] - points[:2, None, :]))
    distance[~near] = np.inf
    neighbour = np.argsort(distance, axis=1, kind="stable")[:, :size]
    return neighbour, np.minimum(near.sum(axis=1), size).astype(np.int32)


def _as_wide(neighbour: NDArray[np.intp], size: int) -> NDArray[np.int32]:
    """Return the neighbours in `size` columns, of which there are fewer minutiae than that."""
    wide = np.zeros((len(neighbour), size), np.int32)
    wide[:, : neighbour.shape[1]] = neighbour
    return wide


def _in_own_frames(
    points: NDArray[np.float64],
    neighbour: NDArray[np.intp],
    count: NDArray[np.int32],
    importance: NDArray[np.float64],
    p: NeighbourhoodParameters,
) -> NDArray[np.float32]:
    """Return the rows of `Neighbourhoods.frame`; zeros where a neighbour is not listed."""
    x, y, c, s = points
    own_c, own_s = c[:, None], s[:, None]
    dx, dy = x[neighbour] - x[:, None], y[neighbour] - y[:, None]
    tolerance = p.tolerance_px + p.tolerance_per_px * np.sqrt(dx * dx + dy * dy)
    listed = np.arange(neighbour.shape[1]) < count[:, None]
    weight = np.take_along_axis(importance, neighbour, axis=1) * listed
    total = np.maximum(weight.sum(axis=1), 1e-9)[:, None]
    weight *= count[:, None] / total
    frame = np.zeros((points.shape[1], 6, p.size), np.float32)
    columns = (
        own_c * dx + own_s * dy,
        own_c * dy - own_s * dx,
        own_c * c[neighbour] + own_s * s[neighbour],
        own_c * s[neighbour] - own_s * c[neighbour],
        1.0 / (tolerance * tolerance),
        np.sqrt(weight),
    )
    for row, column in enumerate(columns):
        frame[:, row, : neighbour.shape[1]] = column * listed
    return frame

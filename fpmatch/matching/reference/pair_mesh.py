"""The mesh of pairs: the paired minutiae of A, triangulated, and the same mesh in print B.

The rings of a pair have equal degree in both prints, as the paper requires. Eight frame points
around the print, mapped by the transform of the pairs, close the rings on the hull.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.constants import COMPILED, FAR_AWAY, FRAME, NEAR2, ROUNDING
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.paper.parametrize import ring_angles, ring_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.intp]
    Plane = NDArray[np.complex128]
    Move = tuple[complex, complex]  # linear, shift


@dataclass(frozen=True, slots=True, eq=False)
class PairMesh:
    """The mesh of the pairs of two prints; minutiae of A and what it predicts for them in B."""

    at: Plane  # (N,): the minutiae of A
    vertex: Plane  # (V,): frame points and paired minutiae of A
    image: Plane  # (V,): the same in B
    owner: Numbers  # (V,): which minutia of A a vertex is; -1 of the frame
    triangles: Numbers  # (T, 3): corners, counter-clockwise from the last vertex
    # (N, D): of each minutia of A, a vertex or not; the last of a ring is repeated up to D, and
    # where a minutia has none, all are equal
    rings: Numbers
    weights: Floats  # (N, D): of the minutia in its ring, eq. (4); NaN where it has none

    def once(self, which: Numbers | int) -> NDArray[np.bool_]:
        """Return which vertices of the rings of minutiae are no repetitions, (..., D)."""
        ring = self.rings[which]
        return np.asarray(ring != np.concatenate([ring[..., -1:], ring[..., :-1]], axis=-1))


def mesh_of_pairs(
    a: Plane,
    b: Plane,
    partner: Numbers,
    move: Move,
    p: MatchParameters = USUAL,
) -> PairMesh:
    """Triangulate the pairs; of those whose minutiae of A coincide, the first."""
    low, high = complex(a.real.min(), a.imag.min()), complex(a.real.max(), a.imag.max())
    angle = np.arange(FRAME) * (2.0 * np.pi / FRAME)
    frame = 0.5 * (low + high) + (abs(0.5 * (high - low)) + p.frame_margin_px) * np.exp(1j * angle)
    paired = np.flatnonzero(partner >= 0)
    first = dict(zip(a[paired[::-1]].tolist(), paired[::-1].tolist(), strict=True))
    paired = np.array(sorted(first.values()), np.intp)
    vertex = np.concatenate([frame, a[paired]])
    image = np.concatenate([move[1] + move[0] * frame, b[partner[paired]]])
    across = triangulate(vertex)
    u, v = np.nonzero(across >= 0)
    last = (u > v) & (u > across[u, v])
    triangles = np.stack([u, v, across[u, v]], axis=1)[last]
    owner = np.append(np.full(FRAME, -1), paired)
    rings = _rings(a, vertex, owner, triangles)
    weights = ring_weights(vertex[rings] - a[:, None])
    rings[np.isnan(weights[:, 0])] = 0
    return PairMesh(a, vertex, image, owner, triangles, rings, weights)


def triangulate(points: Plane) -> Numbers:
    """Triangulate distinct points (N,) that are not on one line by Delaunay's criterion.

    Entry [u, v] of the result (N, N) is the third corner of the triangle to the left of the side
    from u to v, or -1 where there is none. Where the criterion does not decide between the
    diagonals of four points on one circle (within `ROUNDING`, px²), the last point is not on it.
    """
    p, q, r = _triangles(np.column_stack([points.real, points.imag])).T
    across = np.full((len(points), len(points)), -1)
    across[p, q], across[q, r], across[r, p] = r, p, q
    for _ in range(len(points) ** 2):
        wrong = _wrong_diagonals(points, across)
        if not len(wrong):
            break
        u, v = wrong[0]
        a, b = across[u, v], across[v, u]
        across[u, v] = across[v, u] = -1
        for p, q, r in ((b, v, a), (a, u, b)):
            across[p, q], across[q, r], across[r, p] = r, p, q
    return across


def _triangles(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return a Delaunay mesh (T, 3), counter-clockwise; `triangulate` checks it by the criterion.

    Where kernels are compiled it is that of point sets: to import SciPy's takes .2 s.
    """
    if COMPILED:
        return triangulate_checked(points).triangles
    from scipy.spatial import Delaunay  # noqa: PLC0415

    return np.asarray(Delaunay(points).simplices)


def _wrong_diagonals(points: Plane, across: Numbers) -> Numbers:
    """Return the sides (K, 2) between two triangles of which the other diagonal is right."""
    u, v = np.nonzero(np.triu((across >= 0) & (across.T >= 0)))
    corners = np.stack([u, v, across[u, v], across[v, u]])
    spokes = points[corners[:3]] - points[corners[3]]
    p, q, r = spokes
    # positive where the fourth corner is inside the circle of the three
    inside = (_square(spokes) * cross(spokes[[1, 2, 0]], spokes[[2, 0, 1]])).sum(axis=0)
    near = ROUNDING * abs(cross(q - p, r - p))
    last_on_diagonal = corners.argmax(axis=0) < 2
    wrong = (inside > near) | ((abs(inside) <= near) & last_on_diagonal)
    return np.asarray(np.column_stack([u, v])[wrong])


def cross(p: Plane, q: Plane) -> NDArray[np.float64]:
    """Return the cross products of vectors: positive where q lies to the left of p."""
    return np.asarray(p.real * q.imag - p.imag * q.real)


def _square(p: Plane) -> Floats:
    """Return the squares of the lengths of vectors."""
    return np.asarray(p.real * p.real + p.imag * p.imag)


def _rings(at: Plane, vertex: Plane, owner: Numbers, triangles: Numbers) -> Numbers:
    """Return the rings of minutiae: the corners round a vertex, counter-clockwise.

    One that is no vertex has the ring that it would have as one: the corners of the triangles in
    whose circles it lies.
    """
    p, q, r = vertex[triangles.T]
    u, v = q - p, r - p
    with np.errstate(divide="ignore", invalid="ignore"):  # a flat triangle has no circle
        centre = 1j * (u * _square(v) - v * _square(u)) / (2.0 * cross(u, v))
        inside = _square(at[:, None] - (p + centre)) < _square(centre) - ROUNDING
    corner = (triangles[:, :, None] == np.arange(len(vertex))).any(axis=1)
    paired = owner[FRAME:]
    inside[paired] = corner.T[FRAME:]
    around = inside.astype(np.float32) @ corner > 0.0
    around[paired, np.arange(FRAME, len(vertex))] = False
    angle = np.where(around, np.angle(vertex - at[:, None]), np.inf)
    degree = around.sum(axis=1, keepdims=True)
    rank = np.minimum(np.arange(degree.max()), degree - 1)
    return np.take_along_axis(angle.argsort(axis=1), rank, axis=1)


def predict(mesh: PairMesh, direction: Plane, move: Move) -> tuple[Plane, Plane, Floats]:
    """Predict places and directions of A's minutiae in B, and how far the nearest other pair is.

    A minutia is a weighted mean of its ring by eq. (4), and so is its image; its direction turns as
    the spokes of the ring do. One without a ring is mapped by the transform.
    """
    away = mesh.vertex[mesh.rings] - mesh.at[:, None]
    image = (mesh.weights * mesh.image[mesh.rings]).sum(axis=1)
    spokes = mesh.image[mesh.rings] - image[:, None]
    turned = (mesh.weights / (_square(away) + NEAR2) * away.conj() * spokes).sum(axis=1)
    known = abs(turned) > 0.0  # not NaN either
    place = np.where(known, image, move[1] + move[0] * mesh.at)
    turn = np.where(known, turned, move[0])
    nearest = np.where(known[:, None] & (mesh.rings >= FRAME), abs(away), FAR_AWAY).min(axis=1)
    return place, turn / abs(turn) * direction, nearest


def measure(
    mesh: PairMesh, b: Plane, partner: Numbers, predicted: Plane, p: MatchParameters = USUAL
) -> dict[str, float]:
    """Measure the pairs on their rings: sums over the pairs, each 0 to 1."""
    i = mesh.owner[FRAME:]
    i = i[mesh.weights[i, 0] >= 0.0]  # those with a ring
    ring, weight = mesh.rings[i], mesh.weights[i]
    spokes = mesh.vertex[ring] - mesh.at[i, None]
    off = abs(predicted[i] - b[partner[i]])
    off /= p.residual_px + p.residual_per_px * (weight * abs(spokes)).sum(axis=1)
    apart = ring_angles(mesh.vertex[ring]) - ring_angles(mesh.image[ring])  # eq. (3)
    spread = apart.var(axis=1, where=mesh.once(i))
    return {
        "places": float(np.exp(-0.5 * spread / p.place_tolerance**2).sum()),
        "weights": float(np.exp(-0.5 * off**2).sum()),
        "fullness": float(weight[ring >= FRAME].sum()),
    }

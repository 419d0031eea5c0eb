"""The mesh of pairs: the paired minutiae of A, triangulated, and the same mesh in print B.

The rings of a pair have equal degree in both prints, as the paper requires. Eight frame points
around the print, mapped by the transform of the pairs, close the rings on the hull.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.constants.comparison import FAR_AWAY, FRAME, NEAR2, ROUNDING
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.paper.parametrize import ring_angles, ring_weights

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.intp]
    Plane = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class PairMesh:
    """The mesh of the pairs of two prints; minutiae of A and what it predicts for them in B."""

    at: Plane  # (N,): the minutiae of A
    vertex: Plane  # (V,): frame points and paired minutiae of A
    image: Plane  # (V,): the same in B
    owner: Numbers  # (V,): which minutia of A a vertex is; -1 of the frame
    triangles: Numbers  # (T, 3): corners, counter-clockwise from the last vertex
    rings: list[list[int]]  # of each minutia of A, a vertex or not; none where it has no ring


def mesh_of_pairs(
    a: Plane,
    b: Plane,
    partner: Numbers,
    move: tuple[complex, complex],
    p: MatchParameters = USUAL,
) -> PairMesh:
    """Triangulate the pairs; of those whose minutiae of A coincide, the first."""
    low, high = complex(a.real.min(), a.imag.min()), complex(a.real.max(), a.imag.max())
    angle = np.arange(FRAME) * (2.0 * np.pi / FRAME)
    frame = 0.5 * (low + high) + (abs(0.5 * (high - low)) + p.frame_margin_px) * np.exp(1j * angle)
    paired = np.flatnonzero(partner >= 0)
    paired = paired[np.sort(np.unique(a[paired], return_index=True)[1])]
    vertex = np.concatenate([frame, a[paired]])
    image = np.concatenate([move[1] + move[0] * frame, b[partner[paired]]])
    across = triangulate(vertex)
    u, v = np.nonzero(across >= 0)
    last = (u > v) & (u > across[u, v])
    triangles = np.stack([u, v, across[u, v]], axis=1)[last]
    owner = np.append(np.full(FRAME, -1), paired)
    return PairMesh(a, vertex, image, owner, triangles, _rings(a, vertex, owner, triangles))


def triangulate(points: Plane) -> Numbers:
    """Triangulate distinct points (N,) that are not on one line by Delaunay's criterion.

    Entry [u, v] of the result (N, N) is the third corner of the triangle to the left of the side
    from u to v, or -1 where there is none. Where the criterion does not decide between the
    diagonals of four points on one circle (within `ROUNDING`, px²), the last point is not on it.
    """
    p, q, r = _triangles(np.column_stack([points.real, points.imag])).T
    left = cross(points[q] - points[p], points[r] - points[p]) > 0.0
    q, r = np.where(left, q, r), np.where(left, r, q)
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
    """Return a Delaunay mesh (T, 3) of points (N, 2); `triangulate` checks it by the criterion.

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
    p, q, r = points[corners[:3]] - points[corners[3]]
    # positive where the fourth corner is inside the circle of the three
    inside = _square(p) * cross(q, r) + _square(q) * cross(r, p) + _square(r) * cross(p, q)
    near = ROUNDING * abs(cross(q - p, r - p))
    last_on_diagonal = corners.argmax(axis=0) < 2
    wrong = (inside > near) | ((abs(inside) <= near) & last_on_diagonal)
    return np.asarray(np.column_stack([u, v])[wrong])


def chain(following: dict[int, int]) -> list[int]:
    """Return the one closed polygon that sides make up, given as their ends by their starts."""
    ring = [next(iter(following), -1)]
    while len(ring) < len(following):
        ring.append(following.get(ring[-1], -1))
    closed = len(set(ring)) >= 3 and following.keys() == set(ring)
    return ring if closed and following[ring[-1]] == ring[0] else []


def cross(p: Plane, q: Plane) -> NDArray[np.float64]:
    """Return the cross products of vectors: positive where q lies to the left of p."""
    return np.asarray(p.real * q.imag - p.imag * q.real)


def _square(p: Plane) -> Floats:
    """Return the squares of the lengths of vectors."""
    return np.asarray(p.real * p.real + p.imag * p.imag)


def _rings(at: Plane, vertex: Plane, owner: Numbers, triangles: Numbers) -> list[list[int]]:
    """Return the rings of minutiae: round the triangles of a vertex, counter-clockwise.

    One that is no vertex has the ring that it would have as one: round the triangles in whose
    circles it lies.
    """
    p, q, r = vertex[triangles.T]
    u, v = q - p, r - p
    with np.errstate(divide="ignore", invalid="ignore"):  # a flat triangle has no circle
        centre = 1j * (u * abs(v) ** 2 - v * abs(u) ** 2) / (2.0 * cross(u, v))
        inside = abs(at[:, None] - (p + centre)) ** 2 < abs(centre) ** 2 - ROUNDING
    corners = triangles == np.arange(FRAME, len(vertex))[:, None, None]
    inside[owner[FRAME:]] = corners.any(axis=2)
    start, end = triangles, np.roll(triangles, -1, axis=1)
    number = np.full((len(vertex), len(vertex)), len(triangles))
    number[start, end] = np.arange(len(triangles))[:, None]
    beyond = np.pad(inside, ((0, 0), (0, 1)))[:, number[end, start]]
    minutia, *side = np.nonzero(inside[:, :, None] & ~beyond)
    sides = list(zip(start[*side].tolist(), end[*side].tolist(), strict=True))
    first = np.searchsorted(minutia, np.arange(len(at) + 1)).tolist()
    rings: list[list[int]] = []
    for low, high in pairwise(first):
        following = dict(sides[low:high])
        rings.append(chain(following) if len(following) == high - low else [])
    for k, i in enumerate(owner[FRAME:].tolist(), FRAME):
        if k in rings[i]:  # on the border of the mesh: nothing encloses it
            rings[i] = []
    return rings


def by_degree(rings: list[list[int]], which: Numbers) -> Iterator[tuple[Numbers, Numbers]]:
    """Yield minutiae with their rings (K, d), for each degree d that occurs among `which`."""
    degree = np.array([len(rings[i]) for i in which], np.intp)
    for d in np.unique(degree[degree >= 3]):
        of = which[degree == d]
        yield of, np.array([rings[i] for i in of])


def predict(
    mesh: PairMesh, direction: Plane, move: tuple[complex, complex]
) -> tuple[Plane, Plane, Floats]:
    """Predict places and directions of A's minutiae in B, and how far the nearest other pair is.

    A minutia is a weighted mean of its ring by eq. (4), and so is its image; its direction turns as
    the spokes of the ring do. One without a ring is mapped by the transform.
    """
    place, nearest = move[1] + move[0] * mesh.at, np.full(len(mesh.at), FAR_AWAY)
    turn = np.full(len(mesh.at), move[0] / (abs(move[0]) or 1.0))
    for i, ring in by_degree(mesh.rings, np.arange(len(mesh.at))):
        away = mesh.vertex[ring] - mesh.at[i, None]
        weight = ring_weights(away)
        image = (weight * mesh.image[ring]).sum(axis=1)
        spokes = mesh.image[ring] - image[:, None]
        turned = (weight / (abs(away) ** 2 + NEAR2) * away.conj() * spokes).sum(axis=1)
        known = abs(turned) > 0.0  # not NaN either
        of = i[known]
        place[of], turn[of] = image[known], turned[known] / abs(turned[known])
        nearest[of] = np.where(ring >= FRAME, abs(away), FAR_AWAY).min(axis=1)[known]
    return place, turn * direction, nearest


def measure(
    mesh: PairMesh, b: Plane, partner: Numbers, predicted: Plane, p: MatchParameters = USUAL
) -> dict[str, float]:
    """Measure the pairs on their rings: sums over the pairs, each 0 to 1."""
    features = dict.fromkeys(("places", "weights", "fullness"), 0.0)
    for i, ring in by_degree(mesh.rings, mesh.owner[FRAME:]):
        spokes_a = mesh.vertex[ring] - mesh.at[i, None]
        weight = ring_weights(spokes_a)
        of_pairs = ring >= FRAME
        features["fullness"] += float(weight[of_pairs].sum())
        off = abs(predicted[i] - b[partner[i]])
        off /= p.residual_px + p.residual_per_px * (weight * abs(spokes_a)).sum(axis=1)
        features["weights"] += float(np.exp(-0.5 * off**2).sum())
        apart = ring_angles(mesh.vertex[ring]) - ring_angles(mesh.image[ring])  # eq. (3)
        features["places"] += float(np.exp(-0.5 * apart.var(axis=1) / p.place_tolerance**2).sum())
    return features

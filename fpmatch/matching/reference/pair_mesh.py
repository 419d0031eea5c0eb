"""The mesh of pairs: the paired minutiae of A, triangulated, and the same mesh in print B.

The rings of a pair have equal degree in both prints, as the paper requires. Eight frame points
around the print, mapped by the transform of the pairs, close the rings on the hull.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.constants.comparison import FAR_AWAY, FRAME, NEAR2, ROUNDING
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.reference.triangulation import chain, cross, ring_of, triangulate
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
    xy, last_first = np.stack([vertex.real, vertex.imag]), -np.arange(len(vertex))
    across = triangulate(xy, last_first, fan=False, rounding=ROUNDING)
    u, v = np.nonzero(across >= 0)
    last = (u > v) & (u > across[u, v])
    triangles = np.stack([u, v, across[u, v]], axis=1)[last]
    rings = _cavities(a, vertex, triangles)
    for k, i in enumerate(paired.tolist()):
        rings[i] = ring_of(across, FRAME + k)
    return PairMesh(a, vertex, image, np.append(np.full(FRAME, -1), paired), triangles, rings)


def _cavities(at: Plane, vertex: Plane, triangles: Numbers) -> list[list[int]]:
    """Return the rings of places as vertices: round the triangles in whose circles they lie."""
    p, q, r = vertex[triangles.T]
    u, v = q - p, r - p
    with np.errstate(divide="ignore", invalid="ignore"):  # a flat triangle has no circle
        centre = 1j * (u * abs(v) ** 2 - v * abs(u) ** 2) / (2.0 * cross(u, v))
        inside = abs(at[:, None] - (p + centre)) ** 2 < abs(centre) ** 2 - ROUNDING
    start, end = triangles, np.roll(triangles, -1, axis=1)
    number = np.full((len(vertex), len(vertex)), len(triangles))
    number[start, end] = np.arange(len(triangles))[:, None]
    beyond = np.pad(inside, ((0, 0), (0, 1)))[:, number[end, start]]
    rings: list[list[int]] = []
    for border in inside[:, :, None] & ~beyond:
        following = dict(zip(start[border].tolist(), end[border].tolist(), strict=True))
        rings.append(chain(following) if len(following) == border.sum() else [])
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

"""Rings and local match: the neighbours of each minutia, and how alike they are in two prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.matching.constants import LEAST_WEIGHT
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints.prepared import Neighbourhoods
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.paper.parametrize import ring_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray


def neighbourhoods(points: NDArray[np.float64], p: MatchParameters = USUAL) -> Neighbourhoods:
    """Describe the nearest neighbours, in the first two rings, of minutiae (4, N).

    A neighbour is seen in the frame of its minutia, whose direction is +u. It counts by its weight
    of eq. (4) where it is in the ring, by a constant beyond.
    """
    z, d = points[0] + 1j * points[1], points[2] + 1j * points[3]
    mesh = triangulate_checked(np.column_stack([z.real, z.imag]))
    joined = np.zeros((len(z), len(z)), bool)
    joined[tuple(mesh.edges.T)] = True
    joined |= joined.T
    near = joined | (joined.astype(np.intp) @ joined > 0)
    np.fill_diagonal(near, False)
    count = np.minimum(near.sum(axis=1), p.neighbours).astype(np.int32)
    frame = np.zeros((len(z), 6, p.neighbours), np.float32)
    for i in range(len(z)):
        j = np.flatnonzero(near[i])
        away = z[j] - z[i]
        squared = away.real * away.real + away.imag * away.imag
        j = j[np.argsort(squared, kind="stable")[: p.neighbours]]
        weight = np.full(len(z), p.second_ring_weight)
        ring = mesh.one_ring(i)
        of_ring = ring_weights(z[ring] - z[i]) if mesh.interior[i] else np.full(1, np.nan)
        if not np.isnan(of_ring[0]):
            weight[ring] += (1.0 - p.second_ring_weight) * of_ring * len(ring)
        weight = weight[j] * (len(j) / max(weight[j].sum(), LEAST_WEIGHT))
        place, direction = (z[j] - z[i]) * d[i].conj(), d[j] * d[i].conj()
        tolerance = p.tolerance_px + p.tolerance_per_px * abs(z[j] - z[i])
        rows = place.real, place.imag, direction.real, direction.imag, tolerance**-2
        frame[i, :, : len(j)] = *rows, np.sqrt(weight)
    frame[:, 5] = np.minimum(np.rint(100.0 * frame[:, 5].astype(np.float64)), 255.0) / 100.0
    return Neighbourhoods(count, frame)


def local_similarity(
    a: Neighbourhoods, b: Neighbourhoods, p: MatchParameters = USUAL
) -> NDArray[np.float32]:
    """Return the similarity of all minutiae of A and B: the weighted share of like neighbours.

    A neighbour in A counts by the most similar one in B, or not at all.
    """
    min_cosine = p.neighbour_cosine
    (owner_a, rank_a, ours), (owner_b, _, theirs) = map(_neighbours, (a, b))
    reach = 1.01 * np.sqrt(1.0 / ours[4].min(initial=1.0))
    apart = np.subtract.outer(ours[0], theirs[0]) ** 2
    apart += np.subtract.outer(ours[1], theirs[1]) ** 2
    i, j = np.nonzero(apart <= reach * reach)
    u, v, c, s, precision, _ = ours[:, i]
    other_u, other_v, other_c, other_s, _, weight = theirs[:, j]
    du, dv = u - other_u, v - other_v
    near = 1.0 - (du * du + dv * dv) * precision
    turn = (c * other_c + s * other_s - min_cosine) * (1.0 / (1.0 - min_cosine))
    value = np.maximum(near, 0.0) * np.maximum(turn, 0.0) * weight
    best, own = np.zeros((a.frame.shape[2], len(a.count), len(b.count))), a.frame[:, 5].T
    above = value > 0.0
    np.maximum.at(best, (rank_a[i[above]], owner_a[i[above]], owner_b[j[above]]), value[above])
    total = (best * own[:, :, None]).sum(axis=0).astype(np.float32)
    share_a, share_b = (1.0 / np.sqrt(np.maximum(s.count, p.fewest_neighbours)) for s in (a, b))
    return np.asarray(total * np.outer(share_a, share_b), np.float32)


def _neighbours(of: Neighbourhoods) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[Any]]:
    """Return the minutiae that neighbours belong to, their ranks, and their entries (6, K)."""
    owner, rank = np.nonzero(np.arange(of.frame.shape[2]) < of.count[:, None])
    return owner, rank, of.frame[owner, :, rank].astype(np.float64).T

"""Numpy form of the local match: of `_local_kernel` where it is not compiled, and of the reference.

A neighbour of A counts by the most similar one of B, or not at all. Sums are in the kernel's order,
so the results are the same to the last bit.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import KDTree

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


class NeighbourIndex:
    """The neighbours of one print's minutiae, as the kernel's class has them."""

    def __init__(self, count: Any, frame: Any, *_: Any) -> None:
        count, given = np.asarray(count), np.asarray(frame)
        self.minutiae, _, self.size = given.shape
        self.owner, self.rank = np.nonzero(np.arange(self.size) < count[:, None])
        self.entry = given[self.owner, :, self.rank].astype(np.float64).T.copy()  # (6, K)

    @cached_property
    def tree(self) -> KDTree:
        """The places of the neighbours."""
        return KDTree(self.entry[:2].T)

    def to_prints_before(
        self, count: Any, frame: Any, minutiae: int, min_cosine: float, similarity: Any
    ) -> int:
        """Fill ``similarity[i, j]`` for the minutiae i of another print A and j of this one."""
        other = NeighbourIndex(np.asarray(count)[:minutiae], np.asarray(frame)[:minutiae])
        np.asarray(similarity)[:minutiae, : self.minutiae] = like_neighbours(
            other, self, min_cosine
        )
        return 0

    def to_prints_after(
        self, count: Any, frame: Any, minutiae: int, min_cosine: float, similarity: Any
    ) -> int:
        """Fill ``similarity[i, j]`` for the minutiae i of this print and j of another one, B."""
        other = NeighbourIndex(np.asarray(count)[:minutiae], np.asarray(frame)[:minutiae])
        np.asarray(similarity)[: self.minutiae, :minutiae] = like_neighbours(
            self, other, min_cosine
        )
        return 0


def like_neighbours(a: NeighbourIndex, b: NeighbourIndex, min_cosine: float) -> Floats:
    """Return the weight of the neighbours of A's minutiae that are like some of B's, (N, M)."""
    reach = 1.01 * np.sqrt(1.0 / a.entry[4].min(initial=1.0))
    met = a.tree.sparse_distance_matrix(b.tree, reach, output_type="ndarray")
    i, j = met["i"], met["j"]
    u, v, c, s, precision, _ = a.entry[:, i]
    other_u, other_v, other_c, other_s, _, weight = b.entry[:, j]
    du, dv = u - other_u, v - other_v
    near = 1.0 - (du * du + dv * dv) * precision
    turn = (c * other_c + s * other_s - min_cosine) * (1.0 / (1.0 - min_cosine))
    value = np.maximum(near, 0.0) * np.maximum(turn, 0.0) * weight
    best, own = np.zeros((a.size, a.minutiae, b.minutiae)), np.zeros((a.size, a.minutiae))
    above = value > 0.0
    np.maximum.at(best, (a.rank[i[above]], a.owner[i[above]], b.owner[j[above]]), value[above])
    own[a.rank, a.owner] = a.entry[5]
    total = np.zeros(best.shape[1:])
    for rank in range(a.size):
        total += best[rank] * own[rank, :, None]
    return total


def normalize_by_size(
    similarity: Any, count_a: Any, minutiae_a: int, count_b: Any, minutiae_b: int, fewest: int
) -> int:
    """Divide by the geometric mean of the neighbourhoods' sizes, each at least `fewest`."""
    given = np.asarray(similarity)[:minutiae_a, :minutiae_b]
    a, b = (
        1.0 / np.sqrt(np.maximum(np.asarray(count)[:minutiae], fewest).astype(np.float64))
        for count, minutiae in ((count_a, minutiae_a), (count_b, minutiae_b))
    )
    given[:] = given.astype(np.float64) * (a[:, None] * b)
    return 0

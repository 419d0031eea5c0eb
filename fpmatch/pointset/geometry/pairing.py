"""Pair the points of two sets that lie near one another, one to one: nearest pairs first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.pointset.geometry.points import as_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Ints = NDArray[np.int32]

_MAX_NEAR: Final = 5_000_000  # pairs near in x


def greedy_pairs(p: ArrayLike, q: ArrayLike, tolerance: float) -> Ints:
    """Pair the points of `p` (N, 2) and `q` (M, 2) within `tolerance`, nearest pairs first.

    The pairs (K, 2) are sorted by their index into `p`. Equal distances are taken in the order of
    the pairs' midpoints (x, then y), then of their indices, so that exchanging the sets only
    exchanges the columns. Raises PointSetError for a negative tolerance, or one within which lie
    millions of pairs.
    """
    a, b = as_points(p, "p"), as_points(q, "q")
    if not tolerance >= 0:
        raise PointSetError(f"tolerance must be 0 or more, not {number_text(tolerance)}")
    by_x = b[:, 0].argsort(kind="stable")
    x = b[by_x, 0]
    # a little wider than the test below, so that rounding of the bounds excludes no pair
    reach = tolerance * (1 + 1e-9)
    first = x.searchsorted(np.nextafter(a[:, 0] - reach, -np.inf), "left")
    end = x.searchsorted(np.nextafter(a[:, 0] + reach, np.inf), "right")
    if (end - first).sum() > _MAX_NEAR:
        raise PointSetError(f"more than {_MAX_NEAR:,} pairs of points lie within the tolerance")
    i, k = index_pairs(first, end)
    j = by_x[k]
    near = np.hypot(*(a[i] - b[j]).T) <= tolerance
    i, j = i[near], j[near]
    distance, middle = np.hypot(*(a[i] - b[j]).T), a[i] / 2 + b[j] / 2
    order = np.lexsort((middle[:, 1], middle[:, 0], distance))
    partner: dict[int, int] = {}
    taken: set[int] = set()
    for one, other in zip(i[order].tolist(), j[order].tolist(), strict=True):
        if one not in partner and other not in taken:
            partner[one] = other
            taken.add(other)
    return np.array(sorted(partner.items()), dtype=np.int32).reshape(-1, 2)


def index_pairs(
    first: NDArray[np.integer[Any]], end: NDArray[np.integer[Any]]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return, in order, all i and k with ``first[i] <= k < end[i]``."""
    count = end - first
    i = np.repeat(np.arange(len(first)), count)
    return i, np.arange(len(i)) + np.repeat(first - (count.cumsum() - count), count)

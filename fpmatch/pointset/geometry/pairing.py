"""Pair the points of two sets that lie near one another, one to one: nearest pairs first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.pointset.geometry._grid_kernel import find_candidates
from fpmatch.pointset.geometry.points import as_points, sort_into_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

_MAX_NEAR: Final = 5_000_000  # pairs near in x that are listed at once
_MAX_GREEDY: Final = 64  # nearest points that are considered for one, where there are more pairs
_STAY: Final = np.array([1.0, 0.0, 0.0, 0.0])


def greedy_pairs(p: ArrayLike, q: ArrayLike, tolerance: float) -> Ints:
    """Pair the points of `p` (N, 2) and `q` (M, 2) within `tolerance`, nearest pairs first.

    The pairs (K, 2) are sorted by their index into `p`. Equal distances are taken in the order of
    the pairs' midpoints (x, then y), then of their indices, so that exchanging the sets only
    exchanges the columns. Where thousands of points lie together, only the nearest of each count.
    Raises PointSetError for a negative tolerance.
    """
    a, b = as_points(p, "p"), as_points(q, "q")
    if not tolerance >= 0:
        raise PointSetError(f"tolerance must be 0 or more, not {number_text(tolerance)}")
    with np.errstate(over="ignore"):  # points too far apart for float64 are no pair
        i, j = _within(a, b, tolerance)
        distance, middle = np.hypot(*(a[i] - b[j]).T), a[i] / 2 + b[j] / 2
    order = np.lexsort((middle[:, 1], middle[:, 0], distance))
    partner: dict[int, int] = {}
    taken: set[int] = set()
    for one, other in zip(i[order].tolist(), j[order].tolist(), strict=True):
        if one not in partner and other not in taken:
            partner[one] = other
            taken.add(other)
    return np.array(sorted(partner.items()), dtype=np.int32).reshape(-1, 2)


def _within(a: Floats, b: Floats, tolerance: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return all index pairs within the tolerance; of too many, the nearest of each point."""
    by_x = b[:, 0].argsort(kind="stable")
    x = b[by_x, 0]
    # a little wider than the test below, so that rounding of the bounds excludes no pair
    reach = tolerance * (1 + 1e-9)
    first = x.searchsorted(np.nextafter(a[:, 0] - reach, -np.inf), "left")
    end = x.searchsorted(np.nextafter(a[:, 0] + reach, np.inf), "right")
    if (end - first).sum() > _MAX_NEAR:
        i, j = _nearest_within(a, b, tolerance)
        k, m = _nearest_within(b, a, tolerance)
        of_a, of_b = np.unique(np.stack([np.r_[i, m], np.r_[j, k]]), axis=1)
        return of_a, of_b
    i, k = index_pairs(first, end)
    j = by_x[k]
    near = np.hypot(*(a[i] - b[j]).T) <= tolerance
    return i[near], j[near]


def _nearest_within(
    a: Floats, b: Floats, tolerance: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the index pairs of each point of `a` and the nearest of `b` within the tolerance."""
    low, high = b.min(axis=0).tolist(), b.max(axis=0).tolist()
    points = np.array(b.T, order="C")
    grid = sort_into_cells(points, tolerance, low=tuple(low), high=tuple(high))
    grid.split_crowds()
    start = np.empty(len(a) + 1, np.int32)
    near, cost = (np.empty(len(a) * _MAX_GREEDY, kind) for kind in (np.int32, np.float64))
    moved = np.array(a.T, order="C")
    find_candidates(moved, grid, _STAY, tolerance**2, _MAX_GREEDY, start, near, cost)
    i = np.repeat(np.arange(len(a)), np.diff(start))
    return i, np.asarray(grid.order)[near[: start[-1]]].astype(np.int64)


def index_pairs(
    first: NDArray[np.integer[Any]], end: NDArray[np.integer[Any]]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return, in order, all i and k with ``first[i] <= k < end[i]``."""
    count = end - first
    i = np.repeat(np.arange(len(first)), count)
    return i, np.arange(len(i)) + np.repeat(first - (count.cumsum() - count), count)

"""Sets in which points coincide: match the places, then hand out the points of each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.delaunay.triangulation import Triangulation


def has_coincident(mesh: Triangulation) -> bool:
    """Tell whether points of a mesh, which has triangles, coincide."""
    distinct = (len(mesh.triangles) + 2 + len(mesh.hull)) // 2  # Euler
    return distinct < len(mesh)


def unique_points(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the distinct points of a set (N, 2), and for each point which of them it is."""
    places, place = np.unique(points, axis=0, return_inverse=True)
    return places, place.reshape(-1)


def pairs_of_points(
    pairs: NDArray[np.int32], place_p: NDArray[np.int64], place_q: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Return the pairs of points where places are paired: first with first, second with second.

    Parameters
    ----------
    pairs : ndarray of int32, shape (K, 2)
        Paired places of P and of Q, one to one.
    place_p, place_q : ndarray of int64, shape (N,) and (M,)
        The place of each point.

    Returns
    -------
    ndarray of int32, shape (L, 2)
        Indices of points, sorted by the first.

    Examples
    --------
    >>> place_p, place_q = np.array([0, 1, 1]), np.array([1, 0, 1, 1])
    >>> pairs_of_points(np.array([[1, 1]], np.int32), place_p, place_q).tolist()
    [[1, 0], [2, 2]]
    """
    to_q = np.full(place_p.max() + 1, -1, np.int64)
    to_q[pairs[:, 0]] = pairs[:, 1]
    most = max(np.bincount(place_p).max(), np.bincount(place_q).max()) + 1
    # a point's key: the place in Q it belongs to, and which of the points there it is
    wanted = to_q[place_p]
    key_p = np.where(wanted >= 0, wanted * most + _number_at_place(place_p), -1)
    key_q = place_q * most + _number_at_place(place_q)
    _, in_p, in_q = np.intersect1d(key_p, key_q, assume_unique=False, return_indices=True)
    found = np.column_stack([in_p, in_q]).astype(np.int32)
    return found[found[:, 0].argsort()]


def _number_at_place(place: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many earlier points are at the place of each point."""
    order = place.argsort(kind="stable")
    in_order = place[order]
    number = np.empty(len(place), np.int64)
    number[order] = np.arange(len(place)) - in_order.searchsorted(in_order, "left")
    return number

"""Triangulate: the Delaunay mesh of points, and the ring of each (paper, section 3.1).

Points are complex numbers, x + iy. A mesh is a matrix: ``across[u, v]`` is the third corner of the
triangle to the left of the side from u to v, or -1 where there is none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.matching.compiled import COMPILED
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.complex128]
    Numbers = NDArray[np.intp]


def triangulate(xy: NDArray[Any], rank: Numbers, *, fan: bool, rounding: float = 0.0) -> Numbers:
    """Triangulate distinct points (2, N) that are not on one line; see above.

    Delaunay's criterion does not decide between the diagonals of four points on one circle (within
    `rounding`, px²). The diagonal then starts at the point of least rank if `fan`, else it avoids
    this point. The test is exact for Python's integers.
    """
    p, q, r = _triangles(np.array(xy.T, np.float64, order="C")).T
    left = _left(xy[:, q] - xy[:, p], xy[:, r] - xy[:, p]) > 0
    q, r = np.where(left, q, r), np.where(left, r, q)
    across = np.full((len(rank), len(rank)), -1)
    across[p, q], across[q, r], across[r, p] = r, p, q
    for _ in range(len(rank) ** 2):
        wrong = _wrong_diagonals(xy, rank, across, fan=fan, rounding=rounding)
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


def _wrong_diagonals(
    xy: NDArray[Any], rank: Numbers, across: Numbers, *, fan: bool, rounding: float
) -> Numbers:
    """Return the sides (K, 2) between two triangles of which the other diagonal is right."""
    u, v = np.nonzero(np.triu((across >= 0) & (across.T >= 0)))
    corners = np.stack([u, v, across[u, v], across[v, u]])
    p, q, r = (xy[:, corner] - xy[:, corners[3]] for corner in corners[:3])
    # positive where the fourth corner is inside the circle of the three
    inside = (p * p).sum(axis=0) * _left(q, r)
    inside = inside + (q * q).sum(axis=0) * _left(r, p) + (r * r).sum(axis=0) * _left(p, q)
    near = rounding * abs(_left(q - p, r - p))
    on_diagonal = rank[corners].argmin(axis=0) < 2
    wrong = (inside > near) | ((abs(inside) <= near) & (on_diagonal != fan))
    return np.asarray(np.column_stack([u, v])[wrong.astype(bool)])


def ring_of(across: Numbers, v: int) -> list[int]:
    """Return the neighbours of a vertex counter-clockwise; none where they do not enclose it."""
    if ((across[v] >= 0) != (across[:, v] >= 0)).any():
        return []
    return chain({w: int(across[v, w]) for w in np.flatnonzero(across[v] >= 0).tolist()})


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


def _left(p: NDArray[Any], q: NDArray[Any]) -> NDArray[Any]:
    """Return the same of vectors (2, N)."""
    return np.asarray(p[0] * q[1] - p[1] * q[0])

"""Pair the points of two overlaid sets one to one, at the least cost in all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.pointset import _assignment_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset._grid_kernel import CellGrid

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MOST_CANDIDATES: Final = 12
"""Nearest points within the tolerance that a point may be paired with, at most."""

_ROUNDING: Final = 1e-12


def optimal_pairs(p: Floats, grid: CellGrid, move: Floats, tolerance: float) -> Ints:
    """Pair moved points with points in a grid so that Σ(d² - t²) over the pairs is least.

    Nearest-first pairing gives a point's partner to whoever comes closer; this gives both a
    partner where that costs less in all, and of two ways to do so takes the nearer one.

    Parameters
    ----------
    p : ndarray of float64, shape (2, N)
        The points to be moved.
    grid : CellGrid
        The other set.
    move : ndarray of float64, shape (4,)
        s·cos θ, s·sin θ, tx, ty.
    tolerance : float
        t, the largest distance of a pair.

    Returns
    -------
    ndarray of int32, shape (N,)
        Partner of each point, in the order of the grid's cells; -1 for none.
    """
    n, t2 = p.shape[1], tolerance * tolerance
    start = np.empty(n + 1, np.int32)
    near, cost = np.empty(n * MOST_CANDIDATES, np.int32), np.empty(n * MOST_CANDIDATES)
    kernel.find_candidates(p, grid, move, t2, MOST_CANDIDATES, start, near, cost)
    edge, owner = np.empty(n, np.int32), np.empty(len(grid.order), np.int32)
    work = np.empty((5, n), np.int32)
    kernel.assign(start, near, cost, _ROUNDING * t2, edge, owner, np.empty(n), work)
    return edge

"""Pair the points of two sets that lie near one another, one to one, at the least cost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.points.triangles import _assignment_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry._grid_kernel import CellGrid

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MAX_CANDIDATES: Final = 12
"""Nearest points within the tolerance that `optimal_pairs` considers for a point, at most."""

_ROUNDING: Final = 1e-12


def optimal_pairs(p: Floats, grid: CellGrid, move: Floats, tolerance: float) -> Ints:
    """Pair moved points with points in a grid so that Σ(d² - t²) over the pairs is least.

    `p` (2, N) is moved by `move`, (s·cos θ, s·sin θ, tx, ty); t is the `tolerance`. Where two
    points compete for one partner, both get partners if that costs less in all. Returned is the
    partner of each point (N,), in the order of the grid's cells, -1 for none.
    """
    n, t2 = p.shape[1], tolerance * tolerance
    start = np.empty(n + 1, np.int32)
    near, cost = np.empty(n * MAX_CANDIDATES, np.int32), np.empty(n * MAX_CANDIDATES)
    kernel.find_candidates(p, grid, move, t2, MAX_CANDIDATES, start, near, cost)
    edge, owner = np.empty(n, np.int32), np.empty(len(grid.order), np.int32)
    work = np.empty((5, n), np.int32)
    kernel.assign(start, near, cost, _ROUNDING * t2, edge, owner, np.empty(n), work)
    return edge

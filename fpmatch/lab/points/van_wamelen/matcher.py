"""The algorithm of van Wamelen, Li and Iyengar (2004), the paper's baseline.

A pivot of P is mapped to each point of Q in turn, and one of its far neighbours to a neighbour of
similar rank there. Where enough of the pivot's k nearest neighbours then fall within 2t of points
of Q (a local match), least squares and one-to-one pairing within t alternate over the whole of P,
until the number of pairs stops growing; ρm pairs are a match. If no point of Q leads to one, the
next pivot is tried.

With λ and ρ as in the paper, t = λ·r/(2√n), and ln the natural logarithm:

- k = ⌈ln m / (2(ρ - λ²/4)²)⌉ neighbours make the local test;
- k3 = ⌈2λ√(k/π)⌉, made odd, ranks of Q's list are tried for each base neighbour;
- k2 = ⌈ln 0.05 / ln(1 - ρ)⌉ base neighbours, the farthest whose window of ranks fits, are tried;
- all of P is tried as pivots, in a random order: one that has a partner may still fail the tests.

What is left open there, and how it is settled here: r/(2√n) is taken by density, over the area of
Q's convex hull; the rounds of least squares go on past ρm for as long as they gain pairs; the point
nearest to a place is found through a grid of cell side r/√n; and the search gives up, without a
match, after a given amount of work.

References
----------
Van Wamelen, Li, Iyengar, "A fast expected time algorithm for the 2-D point pattern matching
problem", Pattern Recognition 37 (2004), 1699-1711.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.lab.points.van_wamelen import _search_kernel as kernel
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.frames import between_sets, frame_of
from fpmatch.pointset.geometry.point_match import PointMatch, rms_distance, share_of, too_few
from fpmatch.pointset.geometry.points import as_points, sort_into_cells
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.geometry._grid_kernel import CellGrid

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MIN_POINTS: Final = 3
"""Any two points can be mapped to any two others: smaller sets have no match."""

MAX_NEIGHBOURS: Final = 256
"""Bound of k, and of the memory for the lists, where ρ is hardly more than λ²/4."""

MAX_STEPS: Final = 2_000_000_000
"""Default bound of a search: points and cells visited, some tens of seconds."""

BASE_DOUBT: Final = 0.05
"""Chance that none of the base neighbours has a partner, in the formula for k2."""


@dataclass(frozen=True, slots=True)
class SearchPlan:
    """The numbers that follow from the sizes of the sets, ρ and λ."""

    neighbours: int  # k: of a pivot in the local test
    window: int  # k3, odd: ranks of Q's list tried for each base neighbour
    bases: int  # k2: base neighbours tried
    enough_near: int  # neighbours that make a local match
    enough: int  # pairs that make a global match


def match_van_wamelen(
    p: ArrayLike,
    q: ArrayLike,
    *,
    rho: float,
    lambda_: float,
    tolerance: float | None = None,
    seed: int = 0,
    max_steps: int = MAX_STEPS,
) -> PointMatch:
    """Match the pattern `p` (M, 2) with a part of `q` (N, 2) by local neighbourhoods.

    The share `rho` of `p`, in (0, 1] and more than λ²/4, must be paired. `lambda_` is the matching
    distance in mean nearest-neighbour distances of `q`; with a `tolerance`, the matching distance
    in the units of `q`, λ determines the sizes of lists and windows only. `max_steps` bounds the
    points and cells visited. Returned is the first transform of `p` onto `q` that
    pairs ρM points, or none. Raises PointSetError if a set or a parameter cannot be used.
    """
    if not 0 < rho <= 1:
        raise PointSetError(f"rho must be in (0, 1], not {number_text(rho)}")
    if not (lambda_ >= 0 and lambda_**2 / 4 < rho):
        raise PointSetError(f"lambda must be 0 or more, its square less than 4 rho: {lambda_:g}")
    if tolerance is not None and not 0 <= tolerance < math.inf:
        raise PointSetError(f"tolerance must be 0 or more, not {number_text(tolerance)}")
    given_p, given_q = as_points(p, "p"), as_points(q, "q")
    frame_p, frame_q = frame_of(given_p, "p"), frame_of(given_q, "q")
    if min(len(given_p), len(given_q)) < MIN_POINTS:
        return PointMatch.none(reason=too_few(MIN_POINTS))
    plan = plan_search(len(given_p), len(given_q), rho, lambda_)
    unit = np.array(frame_p.apply(given_p).T, order="C")
    grid, spacing = sort_set(frame_q.apply(given_q))
    reach = lambda_ * spacing
    if tolerance is not None:
        reach = math.ldexp(tolerance, -frame_q.exponent)
    m, n, k = len(given_p), len(given_q), plan.neighbours
    rng, order = np.random.default_rng(seed), np.asarray(grid.order)
    pivots = rng.permutation(m).astype(np.int32)
    # a permutation of the set as given: the search is the same whatever the grid
    scene = order.argsort()[rng.permutation(n)].astype(np.int32)
    move, partner, pair = np.empty(4), np.empty(m, np.int32), np.empty(m, np.int32)
    steps, counts = np.zeros(1, np.int64), np.zeros(2, np.int32)
    near_q = nearest_neighbours(np.column_stack([grid.x, grid.y]), k)
    kernel.search(
        *(unit, grid, pivots, scene, nearest_neighbours(unit.T, k), near_q),
        *(plan.bases, plan.window, plan.enough_near, plan.enough, reach, max_steps, move),
        *(partner, pair, np.zeros(n, np.int32), np.empty(k, np.int32), steps, counts),
    )
    pairs, local_matches = counts.tolist()
    if not pairs:
        reason = f"no transform that was tried pairs {plan.enough:,} points, a share rho of P"
        if steps[0] >= max_steps:
            reason += "; the search ended at its limit of points and cells visited"
        return PointMatch.none(local_matches, reason)
    in_p = np.flatnonzero(partner >= 0)
    in_q = order[partner[in_p]]
    transform = between_sets(Similarity.of_move(move), frame_p, frame_q)
    return PointMatch(
        transform=transform,
        pairs=np.column_stack([in_p, in_q]).astype(np.int32),
        matched_share=pairs / min(m, n),
        rms=rms_distance(transform.apply(given_p[in_p]), given_q[in_q]),
        local_matches=local_matches,
    )


def plan_search(m: int, n: int, rho: float, lambda_: float) -> SearchPlan:
    """Return the sizes of lists and windows for m and n points, by the formulas of this module."""
    margin = rho - lambda_**2 / 4
    wanted = math.log(m) / (2 * margin**2)
    k = max(1, min(math.ceil(min(wanted, MAX_NEIGHBOURS)), min(m, n) - 1))
    ranks = math.ceil(2 * lambda_ * math.sqrt(k / math.pi))
    half = min(ranks // 2, (k - 1) // 2)
    rounding = 1e-9  # ln 0.05 / ln(1 - 0.95) is 1.0000000000000002 in floating point
    tries = 0 if rho == 1 else math.ceil(math.log(BASE_DOUBT) / math.log1p(-rho) - rounding)
    return SearchPlan(
        neighbours=k,
        window=2 * half + 1,
        bases=min(max(1, tries), k - 2 * half),
        enough_near=share_of(rho, k),
        enough=share_of(rho, m),
    )


def sort_set(unit: Floats) -> tuple[CellGrid, float]:
    """Sort points (N, 2) of a unit frame into cells of side r/√n, or larger; also return r/(2√n).

    There is one point or more.
    """
    hull = triangulate(unit).hull
    (x, y), n = (unit[hull] - unit[hull[0]]).T, len(unit)
    area = max(0.5 * float(x[:-1] @ y[1:] - y[:-1] @ x[1:]), 0.0)
    side = math.sqrt(area / n)
    high = tuple(unit.max(axis=0).tolist())
    grid = sort_into_cells(np.array(unit.T, order="C"), side or 1.0, low=(0.0, 0.0), high=high)
    return grid, 0.5 * side


def nearest_neighbours(points: Floats, k: int) -> Ints:
    """Return the k nearest others of each of more than k points (N, 2), nearest first."""
    from scipy.spatial import KDTree  # noqa: PLC0415

    near = np.asarray(KDTree(points).query(points, k + 1)[1])
    other = near != np.arange(len(points))[:, None]
    other[other.all(axis=1), -1] = False  # of many points that coincide
    return np.asarray(near[other].reshape(-1, k), dtype=np.int32)

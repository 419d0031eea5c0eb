"""The better matcher for bare points: alike triangles propose, a growing neighbourhood decides.

Whole one-rings seldom survive missing points, jitter and clutter; single triangles of the
triangulation often do. Each triangle of P, the most telling first, meets the triangles of Q that
its shape could have become. Every such pair proposes a similarity transform, which is tested on
one neighbour after the other and refitted as it grows, so that most false ones are given up after
a few. What passes is settled over all points, and accepted only where so many pairs are not to be
expected by chance (a contrario). Where no triangle of the triangulation leads there, triangles
over one-rings with gaps are tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset import _triangle_kernel as kernel
from fpmatch.pointset.delaunay import triangulate
from fpmatch.pointset.pairing import pair_one_to_one
from fpmatch.pointset.point_match import PointMatch
from fpmatch.pointset.points import as_points
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.triangulation import Triangulation

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

FEWEST_POINTS: Final = 4
_LEFT: Final = -0.1  # shapes lie a little beyond 0..1 where a side is only nearly the longest
_NARROWEST_BIN: Final = 0.02
_WIDEST_BIN: Final = 0.2


@dataclass(frozen=True, slots=True)
class TriangleParameters:
    """Set the triangle matcher.

    Parameters
    ----------
    share : float
        Share of neighbours that a true transform is supposed to bring onto points of Q.
    give_up, pass_on : float
        Log-likelihood ratios at which a proposed transform is given up or settled.
    test_length : int
        Neighbours that are tested, at most.
    accept : float
        Expected number of matches as good by chance, under which a match is accepted.
    shape_tolerance : float
        How far the third corner may lie from its place, in tolerances, when the longest sides are
        laid on each other.
    shortest_side : float
        Triangles of Q whose longest side is shorter, in mean spacings (1/√density), are left out:
        jitter leaves them no shape.
    near_tie : float
        A side of Q's triangles counts as longest too where it is at least so much of it.
    max_proposals : int
        Pairs of triangles that are tested in each of the two searches, at most.
    """

    share: float = 0.6
    give_up: float = -2.5
    pass_on: float = 9.0
    test_length: int = 40
    accept: float = 1e-3
    shape_tolerance: float = 1.0
    shortest_side: float = 1.2
    near_tie: float = 0.8
    max_proposals: int = 400_000


def match_by_triangles(
    p: ArrayLike,
    q: ArrayLike,
    *,
    tolerance: float | None = None,
    parameters: TriangleParameters | None = None,
) -> PointMatch:
    """Find the similarity transform that maps points of P onto points of Q, if there is one.

    Parameters
    ----------
    p, q : array_like of float, shape (N, 2) and (M, 2)
        The point sets; a part of P has partners in Q.
    tolerance : float, optional
        How far a partner may lie from its place, in the units of Q; by default a quarter of the
        mean spacing 1/√density of Q.
    parameters : TriangleParameters, optional
        How to search.

    Returns
    -------
    PointMatch
        Transform, pairs and the expected number of matches as good by chance; no transform where
        nothing better than chance was found.

    Raises
    ------
    PointSetError
        If a set is malformed or the tolerance is not positive.

    Examples
    --------
    >>> points = np.random.default_rng(7).uniform(0, 100, (40, 2))
    >>> moved = Similarity(scale=2.0, rotation=0.5, tx=10.0, ty=-4.0).apply(points)
    >>> match = match_by_triangles(points[5:], moved)
    >>> match.matched_share, round(match.transform.scale, 6), match.chance < 1e-6
    (1.0, 2.0, True)
    """
    given = parameters or TriangleParameters()
    source, target = as_points(p, "p"), as_points(q, "q")
    if tolerance is not None and not 0 < tolerance < math.inf:
        raise PointSetError(f"tolerance must be positive, not {tolerance:g}")
    if min(len(source), len(target)) < FEWEST_POINTS:
        return PointMatch.none()
    mesh_p, mesh_q = triangulate(source), triangulate(target)
    if not len(mesh_p.triangles) or not len(mesh_q.triangles):
        return PointMatch.none()
    for triangles in (_delaunay_triangles, _ring_triangles):
        search = _Search(mesh_p, mesh_q, triangles(mesh_p), triangles(mesh_q), tolerance, given)
        found = search.run()
        if found is not None:
            return found
    return PointMatch.none()


class _Search:
    """One search: both sets' triangles labelled, Q's sorted, and what the kernel writes."""

    def __init__(
        self,
        mesh_p: Triangulation,
        mesh_q: Triangulation,
        triangles_p: Ints,
        triangles_q: Ints,
        tolerance: float | None,
        parameters: TriangleParameters,
    ) -> None:
        self.mesh_p, self.mesh_q, self.given = mesh_p, mesh_q, parameters
        self.p = np.array(mesh_p.points.T, order="C")
        self.q = np.array(mesh_q.points.T, order="C")
        self.density = _density(mesh_q)
        spacing = 1.0 / math.sqrt(self.density)
        self.tolerance = 0.25 * spacing if tolerance is None else tolerance
        self.corner_p, self.shape_p = _labelled(self.p, triangles_p, 1.0)
        corner, shape = _labelled(self.q, triangles_q, parameters.near_tie)
        large = shape[:, 2] >= parameters.shortest_side * spacing
        self.corner_q, self.shape_q = corner[large], shape[large]
        widest = parameters.shape_tolerance * self.tolerance / (parameters.shortest_side * spacing)
        self.bins = self._sort_shapes(widest)
        self.cells = self._sort_points(max(spacing, self.tolerance))

    def run(self) -> PointMatch | None:
        """Search, and return what is not to be expected by chance, or None."""
        given, m = self.given, self.p.shape[1]
        tests = max(1, len(self.corner_p) * len(self.corner_q))
        pairs = np.full(m, -1, np.int32)
        move, fit = np.empty(4), np.empty(8)
        tally = np.zeros(3, np.int_)
        log_chance = kernel.search(
            self.p,
            self._order(),
            self.corner_p,
            self.shape_p,
            self.mesh_p.ring_start.copy(),
            self.mesh_p.ring.copy(),
            self.q,
            self.corner_q,
            self.shape_q,
            *self.cells,
            *self.bins,
            self.density,
            self.tolerance,
            given.shape_tolerance * self.tolerance,
            given.share,
            given.give_up,
            given.pass_on,
            given.test_length,
            given.max_proposals,
            math.log(tests),
            math.log(given.accept),
            np.full(m, -1, np.int32),
            np.empty(m, np.int32),
            np.empty(self.q.shape[1], np.int32),
            np.empty(m, np.int32),
            np.empty(m),
            pairs,
            fit,
            move,
            tally,
        )
        if log_chance >= math.log(given.accept):
            return None
        return self._match(move, pairs, math.exp(log_chance), int(tally[1]))

    def _match(self, move: Floats, partner: Ints, chance: float, passed: int) -> PointMatch:
        c, s, tx, ty = move.tolist()
        transform = Similarity(math.hypot(c, s), math.atan2(s, c), tx, ty)
        pairs = pair_one_to_one(transform.apply(self.p.T), self.q.T, self.tolerance)
        residual = transform.apply(self.p.T[pairs[:, 0]]) - self.q.T[pairs[:, 1]]
        return PointMatch(
            transform=transform,
            pairs=pairs,
            matched_share=len(pairs) / min(self.p.shape[1], self.q.shape[1]),
            rms=math.sqrt(float((residual**2).sum()) / len(pairs)),
            local_matches=passed,
            chance=chance,
        )

    def _order(self) -> Ints:
        """Return P's triangles, first those whose match would tell most and is likely to exist.

        A large triangle tells its shape well, but others' points fall into its circle: with a
        share of strangers among them, it survives with probability exp(-strangers·area).
        """
        x, y, side = self.shape_p.T
        flat = np.maximum(2.0 * y, 1e-9)
        radius = side * np.hypot(x, y) * np.hypot(x - 1.0, y) / flat
        strangers = (1.0 - self.given.share) * _density(self.mesh_p)
        telling = side**2 * np.exp(-strangers * np.pi * radius**2)
        return np.argsort(-telling, kind="stable").astype(np.int32)

    def _sort_shapes(self, widest: float) -> tuple[Floats, Ints, Ints, Ints]:
        width = min(max(widest / 2, _NARROWEST_BIN), _WIDEST_BIN)
        size = np.array([int(1.2 / width) + 1, int(1.0 / width) + 1], np.int32)
        corner = (_LEFT, 0.0)
        x, y = np.array(self.shape_q[:, :2].T, order="C")
        start, member = _sorted_into_cells(x, y, corner, width, size)
        return np.array([*corner, width, widest]), size, start, member

    def _sort_points(self, side: float) -> tuple[Floats, Ints, Ints, Ints]:
        low, high = self.q.min(axis=1), self.q.max(axis=1)
        size = ((high - low) / side).astype(np.int32) + 1
        start, member = _sorted_into_cells(self.q[0], self.q[1], tuple(low), side, size)
        return np.array([*low, side, *high]), size, start, member


def _delaunay_triangles(mesh: Triangulation) -> Ints:
    return mesh.triangles.copy()


def _ring_triangles(mesh: Triangulation) -> Ints:
    """Return all triangles of a point and two of its neighbours: one-rings with gaps."""
    triples = [
        (i, int(j), int(k)) for i in range(len(mesh)) for j, k in combinations(mesh.one_ring(i), 2)
    ]
    triangles = np.array(triples, np.int32)
    a, b, c = (mesh.points[triangles[:, r]] for r in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles[area < 0] = triangles[area < 0][:, [0, 2, 1]]
    least = np.take_along_axis(triangles, triangles.argmin(axis=1)[:, None], axis=1)
    turn = (triangles == least).argmax(axis=1)
    columns = (np.arange(3) + turn[:, None]) % 3
    distinct = np.unique(np.take_along_axis(triangles, columns, axis=1)[area != 0], axis=0)
    return np.ascontiguousarray(distinct, np.int32)


def _labelled(points: Floats, triangles: Ints, near_tie: float) -> tuple[Ints, Floats]:
    """Return corners (K, 3) and shapes (K, 3) of triangles, seen from their longest sides."""
    corner = np.empty((3 * len(triangles), 3), np.int32)
    shape = np.empty((3 * len(triangles), 3))
    count = kernel.label_triangles(points, triangles, near_tie, corner, shape)
    return corner[:count], shape[:count]


def _sorted_into_cells(
    x: Floats, y: Floats, corner: tuple[float, ...], side: float, size: Ints
) -> tuple[Ints, Ints]:
    columns, rows = size.tolist()
    start, member = np.empty(columns * rows + 1, np.int32), np.empty(len(x), np.int32)
    kernel.sort_into_cells(x, y, len(x), *corner, side, columns, rows, start, member)
    return start, member


def _density(mesh: Triangulation) -> float:
    """Return points an area of the convex hull."""
    x, y = mesh.points[mesh.hull].T
    area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    return len(mesh) / area

"""The better matcher for bare points: alike triangles propose, a growing neighbourhood decides.

Whole one-rings seldom survive missing points, jitter and clutter; single triangles of the
triangulation often do. Each triangle of P, the most telling first, meets the triangles of Q that
its shape could have become. Every such pair proposes a similarity transform, which is tested on
one neighbour after the other and refitted as it grows, so that most false ones are given up after
a few. What passes is settled over all points, and accepted only where so many pairs are not to be
expected by chance (a contrario). Where no triangle of the triangulation leads there, triangles
over one-rings with gaps are tried. The pairs of what is accepted are the best one-to-one pairing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.assignment import optimal_pairs
from fpmatch.pointset.coincident import has_coincident, pairs_of_points, unique_points
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.frames import between_sets, frame_if_needed
from fpmatch.pointset.grid import sort_into_cells
from fpmatch.pointset.point_match import PointMatch
from fpmatch.pointset.points import IDENTITY, box_of, points_in_box
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.triangles import _overlay_kernel as overlay
from fpmatch.pointset.triangles._proposal_kernel import hit_log_likelihoods, propose
from fpmatch.pointset.triangles.descriptors import (
    TriangleDescriptors,
    delaunay_triangles,
    density_of,
    density_over_hull,
    describe_all,
    describe_large,
    ring_triangles,
    sort_by_shape,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset._grid_kernel import CellGrid
    from fpmatch.pointset.delaunay.triangulation import Triangulation

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

FEWEST_TO_TELL: Final = 3
"""Fewer points lie on any others: no set to match."""

FEWEST_POINTS: Final = 4
"""Fewer points match too many others to be told from chance."""

_WIDEST_TOLERANCE: Final = 0.6  # mean spacings: beyond, a point finds a partner anywhere
_MOST_ROUNDS: Final = 12
_GAIN_STEPS: Final = 33
_MOST_GROWN: Final = 2_000  # neighbours that fix a transform well enough to overlay any set


@dataclass(frozen=True, slots=True)
class TriangleParameters:
    """Set the triangle matcher.

    Parameters
    ----------
    share : float
        Share of neighbours that a true transform is supposed to bring onto points of Q.
    reach : float
        Area in which a neighbour is looked for during the test, in squared tolerances: few
        partners lie as far off as they may.
    give_up, pass_on : float
        Log-likelihood ratios at which a proposed transform is given up or settled.
    pass_small : float
        The ratio that is enough where P has no more neighbours to ask.
    test_length : int
        Neighbours that are tested, at most.
    accept : float
        Expected number of matches as good by chance, under which a match is accepted.
    content : float
        Share of the smaller set with which the first match that is accepted is the answer; after
        one of less, the search goes on for a better one.
    extra_proposals : int
        Pairs of triangles that are tested then.
    shape_tolerance : float
        How far the third corner may lie from its place, in tolerances, when the longest sides are
        laid on each other.
    shortest_side : float
        Triangles of Q whose longest side is shorter, in mean spacings (1/√density), are left out:
        jitter leaves them no shape.
    near_tie : float
        A side of Q's triangles counts as longest too where it is at least so much of it.
    max_proposals : int
        Pairs of triangles that are tested, at most.
    max_overlaid : int
        Points that are overlaid to refine what passed, at most.
    """

    share: float = 0.6
    reach: float = 0.6
    give_up: float = -2.5
    pass_on: float = 14.0
    pass_small: float = 4.0
    test_length: int = 60
    accept: float = 1e-3
    content: float = 0.5
    extra_proposals: int = 2_000
    shape_tolerance: float = 0.75
    shortest_side: float = 1.2
    near_tie: float = 0.8
    max_proposals: int = 200_000
    max_overlaid: int = 20_000_000


_USUAL: Final = TriangleParameters()


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
        The point sets; a part of P has partners in Q. The search is quick where P is the smaller.
    tolerance : float, optional
        How far a partner may lie from its place, in the units of Q; by default a quarter of the
        mean spacing 1/√density of the larger set. A transform is sought by nearer partners where
        it is more than 0.6 of these.
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
        If a set is malformed, has fewer than three points or all of them on one line, its
        coordinates or extent are beyond 2**±300, or the tolerance is not positive.

    Examples
    --------
    >>> points = np.random.default_rng(7).uniform(0, 100, (40, 2))
    >>> moved = Similarity(scale=2.0, rotation=0.5, tx=10.0, ty=-4.0).apply(points)
    >>> match = match_by_triangles(points[5:], moved)
    >>> match.matched_share, round(match.transform.scale, 6), match.chance < 1e-6
    (1.0, 2.0, True)
    """
    if tolerance is not None and not 0 < tolerance < math.inf:
        raise PointSetError(f"tolerance must be positive, not {tolerance:g}")
    p_set, q_set = _GivenSet("p", p), _GivenSet("q", q)
    given = parameters or _USUAL
    if tolerance is None and len(p_set) > len(q_set):
        return _inverted(_match(q_set, p_set, None, given))
    return _match(p_set, q_set, tolerance, given)


def check_spread(points: ArrayLike, name: str) -> None:
    """Refuse a set that nothing can be told of: too few points, or all on one line.

    Raises
    ------
    PointSetError
        If the set is so, or malformed.
    """
    _GivenSet(name, points)


class _GivenSet:
    """A set as given, in its frame and triangulated."""

    def __init__(self, name: str, given: ArrayLike) -> None:
        points, self.box = points_in_box(given, name)
        if len(points) < FEWEST_TO_TELL:
            raise PointSetError(f"{name}: fewer than three points: {len(points)}")
        self.name, self.given = name, points
        self.frame = frame_if_needed(points, self.box, name)
        if self.frame is not IDENTITY:
            points = self.frame.apply(points)
            self.box = box_of(points)
        self.mesh = triangulate_checked(points)
        if not len(self.mesh.triangles):
            raise PointSetError(f"{name}: all points lie on one line")

    def __len__(self) -> int:
        return len(self.given)


def _inverted(match: PointMatch) -> PointMatch:
    """Return the match of P with Q that was found as one of Q with P."""
    if match.transform is None:
        return match
    pairs = np.ascontiguousarray(match.pairs[match.pairs[:, 1].argsort(), ::-1])
    transform = match.transform.inverse()
    return replace(match, transform=transform, pairs=pairs, rms=match.rms * transform.scale)


def _match(
    p: _GivenSet, q: _GivenSet, tolerance: float | None, parameters: TriangleParameters
) -> PointMatch:
    """Match two sets, places where points coincide."""
    if has_coincident(p.mesh) or has_coincident(q.mesh):
        (places_p, place_p), (places_q, place_q) = unique_points(p.given), unique_points(q.given)
        p_places, q_places = _GivenSet(p.name, places_p), _GivenSet(q.name, places_q)
        match = _match_distinct(p_places, q_places, tolerance, parameters)
        pairs = pairs_of_points(match.pairs, place_p, place_q)
        return replace(match, pairs=pairs, matched_share=len(pairs) / min(len(p), len(q)))
    return _match_distinct(p, q, tolerance, parameters)


def _match_distinct(
    p: _GivenSet, q: _GivenSet, tolerance: float | None, parameters: TriangleParameters
) -> PointMatch:
    """Match two sets of which no points coincide, but for rounding."""
    if min(len(p), len(q)) < FEWEST_POINTS:
        return PointMatch.none()
    reach = None if tolerance is None else math.ldexp(tolerance, -q.frame.exponent)
    search = _Search(p.mesh, q.mesh, q.box, reach, parameters)
    if not search.run():
        return PointMatch.none(search.passed)
    pairs, rms = search.pair()
    return PointMatch(
        transform=between_sets(_as_similarity(search.move), p.frame, q.frame),
        pairs=pairs,
        matched_share=len(pairs) / min(len(p), len(q)),
        rms=math.ldexp(rms, q.frame.exponent),
        local_matches=search.passed,
        chance=math.exp(search.log_chance),
    )


class _Search:
    """A search: P's triangles in order, Q's by shape, Q's points in cells, and where it stands."""

    def __init__(
        self,
        mesh_p: Triangulation,
        mesh_q: Triangulation,
        box_q: tuple[float, float, float, float],
        tolerance: float | None,
        parameters: TriangleParameters,
    ) -> None:
        self.mesh_p, self.mesh_q, self.given = mesh_p, mesh_q, parameters
        self.p, self.q = (np.array(mesh.points.T, order="C") for mesh in (mesh_p, mesh_q))
        self.density_p, self.density = density_over_hull(mesh_p, self.p), density_of(mesh_q, self.q)
        self.spacing = 1.0 / math.sqrt(self.density)
        self.pairing_tolerance = 0.25 * self.spacing if tolerance is None else tolerance
        self.tolerance = min(self.pairing_tolerance, _WIDEST_TOLERANCE * self.spacing)
        self.grid = self._cells(*box_q)
        self.move = np.empty(4)
        self.log_chance = math.inf
        self.tried = 0
        self.passed = 0

    def run(self) -> bool:
        """Search, first the triangulations, then their one-rings with gaps; tell of success."""
        return self._through(delaunay_triangles) or self._through(ring_triangles)

    def pair(self) -> tuple[Ints, float]:
        """Return the best pairs (K, 2) under the move, which is refitted to them, and their rms."""
        partner = optimal_pairs(self.p, self.grid, self.move, self.pairing_tolerance)
        overlay.fit(self.p, self.grid, partner, self.move)
        pairs = np.empty((overlay.count_pairs(partner), 2), np.int32)
        return pairs, overlay.list_pairs(self.p, self.grid, partner, self.move, pairs)

    def _through(self, triangles: Callable[[Triangulation, Floats], Ints]) -> bool:
        """Search one kind of triangle until a proposal is accepted."""
        given = self.given
        if self.tried >= given.max_proposals:
            return False
        strangers = (1.0 - given.share) * self.density_p
        ours = describe_all(self.p, triangles(self.mesh_p, self.p), strangers)
        shortest = given.shortest_side * self.spacing
        theirs = describe_large(self.q, triangles(self.mesh_q, self.q), given.near_tie, shortest)
        widest = given.shape_tolerance * self.tolerance / shortest
        log_tests = math.log(max(1, ours.number * theirs.number))
        given_to_tests = self._arguments(ours, theirs, widest)
        owner, distance2 = np.empty(len(self.mesh_q), np.int32), np.empty(len(self.mesh_p))
        partner, fit, move = np.empty(len(self.mesh_p), np.int32), np.empty(8), np.empty(4)
        log_accept = math.log(given.accept)
        content = given.content * min(len(self.mesh_p), len(self.mesh_q))
        state = np.array([0, 0, self.tried, 0], np.int_)
        most, t2 = given.max_proposals, self.tolerance**2
        while propose(*given_to_tests, most, fit, state):
            self.passed += 1
            if self.passed * len(self.mesh_p) > given.max_overlaid:
                break
            move[:] = _move(fit)
            inside = overlay.refine(
                self.p, self.grid, t2, _MOST_ROUNDS, owner, partner, distance2, move
            )
            if inside < 0:
                continue
            chance = log_tests + overlay.log_chance(partner, distance2, inside, t2, self.density)
            if chance < self.log_chance:
                self.log_chance, self.move = chance, move.copy()
                if chance >= log_accept:
                    continue
                if overlay.count_pairs(partner) >= content:
                    return True
                most = min(most, int(state[2]) + given.extra_proposals)
        self.tried = int(state[2])
        return self.log_chance < log_accept

    def _arguments(
        self, ours: TriangleDescriptors, theirs: TriangleDescriptors, widest: float
    ) -> tuple[Any, ...]:
        """Return what `propose` is given of the sets and of how to test."""
        given, m = self.given, len(self.mesh_p)
        reach2 = given.reach * self.tolerance**2
        gain = np.empty(_GAIN_STEPS)
        miss = hit_log_likelihoods(math.pi * reach2 * self.density, given.share, gain)
        half_of_all = 0.5 * (m - 3) * float(gain[0])
        return (
            self.p,
            ours.negative_information[: ours.number].argsort(kind="stable"),
            ours.corner,
            ours.shape,
            self.mesh_p.ring_start,
            self.mesh_p.ring,
            self.q,
            self.grid,
            theirs.corner,
            theirs.side,
            sort_by_shape(theirs, widest),
            given.shape_tolerance * self.tolerance,
            widest,
            reach2,
            gain,
            miss,
            given.give_up,
            given.pass_on,
            min(given.pass_small, half_of_all),
            given.test_length,
            np.zeros(m, np.int32),
            np.empty(min(m, _MOST_GROWN), np.int32),
        )

    def _cells(self, left: float, right: float, top: float, bottom: float) -> CellGrid:
        side = max(0.7 * self.spacing, self.tolerance)
        t = self.tolerance
        low, high = (left - t, top - t), (right + t, bottom + t)
        return sort_into_cells(self.q, side, low=low, high=high)


def _move(fit: Floats) -> tuple[float, float, float, float]:
    """Return the move of a fit: number, means of P and of Q, Σ|p|², Σp·q, Σp×q."""
    _, px, py, qx, qy, spread, cosine, sine = fit.tolist()
    a, b = cosine / spread, sine / spread
    return a, b, qx - a * px + b * py, qy - b * px - a * py


def _as_similarity(move: Floats) -> Similarity:
    a, b, tx, ty = move.tolist()
    return Similarity(math.hypot(a, b), math.atan2(b, a), tx, ty)

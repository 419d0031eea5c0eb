"""The default matcher for bare points: similar triangles propose, a growing neighbourhood decides.

Whole one-rings seldom survive missing points, jitter and outliers; single triangles of the
triangulation often do. Each triangle of P, the most informative first, is compared with the
triangles of Q of nearly its shape. Every such pair proposes a similarity transform, which is tested
on one neighbour after the other and refitted as it grows, so that most false ones are rejected
after a few. A transform that passes is refined over all points, and accepted only where so many
pairs are not expected by chance (a contrario). If no triangle of the triangulation leads to a
match, triangles over one-rings with gaps are tried. The pairs are the optimal one-to-one pairing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset._similarity_kernel import fit_partners
from fpmatch.pointset.delaunay.triangulate import triangulate_checked
from fpmatch.pointset.frames import IDENTITY, between_sets, frame_if_needed
from fpmatch.pointset.grid import sort_into_cells
from fpmatch.pointset.pairing import optimal_pairs
from fpmatch.pointset.point_match import PointMatch
from fpmatch.pointset.points import pairs_of_coincident, points_in_box, unique_points
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.triangles import _overlay_kernel as overlay
from fpmatch.pointset.triangles._proposal_kernel import hit_log_likelihoods, propose
from fpmatch.pointset.triangles.descriptors import (
    TriangleDescriptors,
    density_of,
    density_over_hull,
    describe_all,
    describe_large,
    ring_triangles,
    sort_by_shape,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MIN_POINTS: Final = 3
"""Any two points can be mapped to any two others: smaller sets are refused."""

MIN_POINTS_TO_MATCH: Final = 4
"""Smaller sets match too many others to be distinguished from chance."""

_WIDEST_TOLERANCE: Final = 0.6  # mean spacings: beyond, a point finds a partner anywhere
_MAX_ROUNDS: Final = 12
_GAIN_STEPS: Final = 33
_MAX_GROWN: Final = 2_000  # neighbours that determine a transform well enough for any set


@dataclass(frozen=True, slots=True)
class TriangleParameters:
    """Set the triangle matcher."""

    share: float = 0.6
    """Share of neighbours that a true transform is supposed to map to points of Q."""
    reach: float = 0.6
    """Area in which the test seeks a partner, in squared tolerances: few lie as far as they may."""
    reject: float = -2.5
    """Log-likelihood ratio under which the test of a proposal ends."""
    accept: float = 14.0
    """Log-likelihood ratio over which the test of a proposal ends."""
    accept_small: float = 4.0
    """The ratio that suffices where P has no more neighbours to test."""
    test_length: int = 60
    """Neighbours that are tested, at most."""
    max_chance: float = 1e-3
    """Expected number of matches as good by chance, under which a match is accepted."""
    sufficient_share: float = 0.5
    """Share of the smaller set with which the first match ends the search, else it goes on."""
    extra_proposals: int = 2_000
    """Pairs of triangles that are tested after a match of fewer points."""
    shape_tolerance: float = 0.75
    """Largest distance of the third corners, in tolerances, when the longest sides coincide."""
    shortest_side: float = 1.2
    """Least longest side of Q's triangles, in mean spacings: jitter destroys smaller shapes."""
    near_tie: float = 0.8
    """Q's triangles are also described by sides of at least this ratio to the longest."""
    max_proposals: int = 200_000
    """Pairs of triangles that are tested, at most."""
    max_overlaid: int = 20_000_000
    """Points that are overlaid to refine proposals that passed, at most."""


_DEFAULT: Final = TriangleParameters()


def match_by_triangles(
    p: ArrayLike,
    q: ArrayLike,
    *,
    tolerance: float | None = None,
    parameters: TriangleParameters | None = None,
) -> PointMatch:
    """Find the similarity transform that maps points of P onto points of Q, if there is one.

    This is `fpmatch.match_points` with parameters. The search is fast where P is the smaller set.
    The tolerance is a quarter of the mean spacing 1/√density of the larger set by default; the
    search for the transform uses at most 0.6 of that spacing.
    """
    if tolerance is not None and not 0 < tolerance < math.inf:
        raise PointSetError(f"tolerance must be positive, not {tolerance:g}")
    p_set, q_set = GivenSet("p", p), GivenSet("q", q)
    given = parameters or _DEFAULT
    if tolerance is None and len(p_set) > len(q_set):
        return _match(q_set, p_set, None, given).inverse()
    return _match(p_set, q_set, tolerance, given)


class GivenSet:
    """A set as given, in its frame and triangulated.

    One that is malformed, of too few points, or all on one line, is refused with a
    `PointSetError` under its name.
    """

    def __init__(self, name: str, given: ArrayLike) -> None:
        points, box = points_in_box(given, name)
        if len(points) < MIN_POINTS:
            raise PointSetError(f"{name}: fewer than three points: {len(points)}")
        self.name, self.given = name, points
        self.frame = frame_if_needed(points, box, name)
        if self.frame is not IDENTITY:
            points, box = points_in_box(self.frame.apply(points), name)
        self.box = box
        self.mesh = triangulate_checked(points)
        if not len(self.mesh.triangles):
            raise PointSetError(f"{name}: all points lie on one line")

    def __len__(self) -> int:
        return len(self.given)


def _match(
    p: GivenSet, q: GivenSet, tolerance: float | None, parameters: TriangleParameters
) -> PointMatch:
    """Match two sets; where points coincide, their distinct points."""
    if not (p.mesh.has_coincident or q.mesh.has_coincident):
        return _match_distinct(p, q, tolerance, parameters)
    (distinct_p, index_p), (distinct_q, index_q) = unique_points(p.given), unique_points(q.given)
    match = _match_distinct(
        GivenSet(p.name, distinct_p), GivenSet(q.name, distinct_q), tolerance, parameters
    )
    pairs = pairs_of_coincident(match.pairs, index_p, index_q)
    return replace(match, pairs=pairs, matched_share=len(pairs) / min(len(p), len(q)))


def _match_distinct(
    p: GivenSet, q: GivenSet, tolerance: float | None, parameters: TriangleParameters
) -> PointMatch:
    """Match two sets of which no points coincide, but for rounding."""
    if min(len(p), len(q)) < MIN_POINTS_TO_MATCH:
        return PointMatch.none()
    reach = None if tolerance is None else math.ldexp(tolerance, -q.frame.exponent)
    search = _Search(p, q, reach, parameters)
    if not search.run():
        return PointMatch.none(search.passed)
    pairs, rms = search.pair()
    return PointMatch(
        transform=between_sets(Similarity.of_move(search.move), p.frame, q.frame),
        pairs=pairs,
        matched_share=len(pairs) / min(len(p), len(q)),
        rms=math.ldexp(rms, q.frame.exponent),
        local_matches=search.passed,
        chance=math.exp(search.log_chance),
    )


class _Search:
    """A search for a transform and its state."""

    def __init__(
        self, p: GivenSet, q: GivenSet, tolerance: float | None, parameters: TriangleParameters
    ) -> None:
        self.mesh_p, self.mesh_q, self.given = p.mesh, q.mesh, parameters
        self.p, self.q = (np.array(mesh.points.T, order="C") for mesh in (p.mesh, q.mesh))
        self.density_p, self.density = density_over_hull(p.mesh, self.p), density_of(q.mesh, self.q)
        self.spacing = 1.0 / math.sqrt(self.density)
        self.pairing_tolerance = 0.25 * self.spacing if tolerance is None else tolerance
        self.tolerance = t = min(self.pairing_tolerance, _WIDEST_TOLERANCE * self.spacing)
        left, right, top, bottom = q.box
        low, high = (left - t, top - t), (right + t, bottom + t)
        self.grid = sort_into_cells(self.q, max(0.7 * self.spacing, t), low=low, high=high)
        self.move = np.empty(4)
        self.log_chance = math.inf
        self.tried = 0
        self.passed = 0

    def run(self) -> bool:
        """Search the triangulations, then one-rings with gaps; return whether it succeeded."""
        return self._search(self.mesh_p.triangles, self.mesh_q.triangles) or self._search(
            ring_triangles(self.mesh_p, self.p), ring_triangles(self.mesh_q, self.q)
        )

    def pair(self) -> tuple[Ints, float]:
        """Refit the move to its optimal pairs; return these (K, 2) and their rms distance."""
        partner = optimal_pairs(self.p, self.grid, self.move, self.pairing_tolerance)
        fit_partners(self.p, self.grid, partner, self.move)
        pairs = np.empty((np.count_nonzero(partner >= 0), 2), np.int32)
        return pairs, overlay.list_pairs(self.p, self.grid, partner, self.move, pairs)

    def _search(self, of_p: Ints, of_q: Ints) -> bool:
        """Search one kind of triangle, (T, 3) each, until a proposal is accepted."""
        given, m = self.given, len(self.mesh_p)
        if self.tried >= given.max_proposals:
            return False
        outliers = (1.0 - given.share) * self.density_p
        in_p = describe_all(self.p, of_p, outliers)
        shortest = given.shortest_side * self.spacing
        in_q = describe_large(self.q, of_q, given.near_tie, shortest)
        arguments = self._arguments(in_p, in_q, given.shape_tolerance * self.tolerance / shortest)
        log_tests, log_max = math.log(max(1, in_p.number * in_q.number)), math.log(given.max_chance)
        sufficient = given.sufficient_share * min(m, len(self.mesh_q))
        owner, distance2 = np.empty(len(self.mesh_q), np.int32), np.empty(m)
        partner, fit, move = np.empty(m, np.int32), np.empty(8), np.empty(4)
        state = np.array([0, 0, self.tried, 0], np.int_)
        max_proposals, t2 = given.max_proposals, self.tolerance**2
        while propose(*(*arguments, max_proposals, fit, state)):
            self.passed += 1
            if self.passed * m > given.max_overlaid:
                break
            move[:] = _move(fit)
            inside = overlay.refine(
                self.p, self.grid, t2, _MAX_ROUNDS, owner, partner, distance2, move
            )
            if inside < 0:
                continue
            chance = log_tests + overlay.log_chance(partner, distance2, inside, t2, self.density)
            if chance < self.log_chance:
                self.log_chance, self.move = chance, move.copy()
                if chance >= log_max:
                    continue
                if np.count_nonzero(partner >= 0) >= sufficient:
                    return True
                max_proposals = min(max_proposals, int(state[2]) + given.extra_proposals)
        self.tried = int(state[2])
        return self.log_chance < log_max

    def _arguments(
        self, in_p: TriangleDescriptors, in_q: TriangleDescriptors, widest: float
    ) -> tuple[Any, ...]:
        """Return the arguments of `propose` that do not change during the search."""
        given, m = self.given, len(self.mesh_p)
        reach2 = given.reach * self.tolerance**2
        gain = np.empty(_GAIN_STEPS)
        miss = hit_log_likelihoods(math.pi * reach2 * self.density, given.share, gain)
        half_of_all = 0.5 * (m - 3) * float(gain[0])
        return (
            self.p,
            in_p.negative_information[: in_p.number].argsort(kind="stable"),
            *(in_p.corner, in_p.shape, self.mesh_p.ring_start, self.mesh_p.ring),
            *(self.q, self.grid, in_q.corner, in_q.side, sort_by_shape(in_q, widest)),
            *(given.shape_tolerance * self.tolerance, widest, reach2, gain, miss),
            *(given.reject, given.accept, min(given.accept_small, half_of_all)),
            *(given.test_length, np.zeros(m, np.int32), np.empty(min(m, _MAX_GROWN), np.int32)),
        )


def _move(fit: Floats) -> tuple[float, float, float, float]:
    """Return the move of a fit (see `_proposal_kernel`)."""
    _, px, py, qx, qy, spread, dot, cross = fit.tolist()
    a, b = dot / spread, cross / spread
    return a, b, qx - a * px + b * py, qy - b * px - a * py

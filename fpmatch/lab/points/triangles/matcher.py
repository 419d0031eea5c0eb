"""The default matcher for bare points: similar triangles propose, a growing neighbourhood decides.

Whole one-rings seldom survive missing points, jitter and outliers; single triangles of the
triangulation often do. Each triangle of P, the most informative first, is compared with the
triangles of Q of nearly its shape. Every such pair proposes a similarity transform, which is tested
on one neighbour after the other and refitted as it grows, so that most false ones are rejected
after a few. A transform that passes is refined over all points, and accepted only where so many
pairs are not expected by chance (a contrario). Where spacings are uneven, chance is that of the
points around each place, and pairs that competing maps find too are hardly evidence.
If no triangle of the triangulation leads to a
match, triangles over one-rings with gaps are tried. The pairs are the optimal one-to-one pairing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.points.triangles import _overlay_kernel as overlay
from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
from fpmatch.lab.points.triangles._proposal_kernel import SimilarityTest, propose
from fpmatch.lab.points.triangles.descriptors import (
    TriangleDescriptors,
    density_over_hull,
    describe_all,
    describe_large,
    ring_triangles,
    sort_by_shape,
)
from fpmatch.lab.points.triangles.given_set import GivenSet, Target, check_tolerance, match_given
from fpmatch.lab.points.triangles.pairing import optimal_pairs
from fpmatch.lab.points.triangles.search import (
    MAX_ROUNDS,
    Proposals,
    Screening,
    SearchParameters,
)
from fpmatch.lab.points.triangles.verification import Verdict, Verification
from fpmatch.pointset.geometry.frames import between_sets
from fpmatch.pointset.geometry.point_match import PointMatch, too_few
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MIN_POINTS_TO_MATCH: Final = 4
"""Smaller sets match too many others to be distinguished from chance."""

_EXACT: Final = 1 / 64  # squared tolerances: nearer pairs end a search among rivals
_MOST_REFUTED: Final = 16  # maps that are no better than their rivals, before a search ends
_BETTER_MAPS: Final = 8  # maps that are judged, at most, where one leads to a better one


@dataclass(frozen=True, slots=True)
class TriangleParameters(SearchParameters):
    """Set the triangle matcher."""

    extra_proposals: int = 2_000
    """Pairs of triangles that are tested after a match of fewer points."""
    shape_tolerance: float = 0.75
    """Largest distance of the third corners, in tolerances, when the longest sides coincide."""
    shortest_side: float = 1.2
    """Least longest side of Q's triangles, in mean spacings: jitter destroys smaller shapes."""
    near_tie: float = 0.8
    """Q's triangles are also described by sides of at least this ratio to the longest."""


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
    The tolerance is a quarter of the spacing of the larger set by default: 1/√density, or less
    where the second nearest distances are smaller than in random points. The search for the
    transform uses at most 0.6 of the mean spacing.
    """
    check_tolerance(tolerance)
    p_set, q_set = GivenSet("p", p), GivenSet("q", q)
    match = partial(_match, tolerance=tolerance, parameters=parameters or _DEFAULT)
    return match_given(p_set, q_set, tolerance, match)


def _match(
    p: GivenSet, q: GivenSet, tolerance: float | None, parameters: TriangleParameters
) -> PointMatch:
    """Match two sets of which no points coincide, but for rounding."""
    if min(len(p), len(q)) < MIN_POINTS_TO_MATCH:
        return PointMatch.none(reason=too_few(MIN_POINTS_TO_MATCH))
    search = _Search(p, q, Target.of(q, tolerance), parameters)
    if not search.run():
        reason, equal = search.proposals.reason, search.equal_maps
        if equal > 1:
            reason = f"at least {equal:,} maps fit equally well: which is the true one is not known"
        elif search.refuted:
            reason = (
                "the points that pair are on rows or in periods, which other maps pair as well: no "
                "transform that was tried pairs more points than expected by chance"
            )
        none = PointMatch.none(search.proposals.passed, reason)
        return replace(none, equal_maps=equal)
    pairs, rms = search.pair()
    return PointMatch(
        transform=between_sets(Similarity.of_move(search.move), p.frame, q.frame),
        pairs=pairs,
        matched_share=len(pairs) / min(len(p), len(q)),
        rms=math.ldexp(rms, q.frame.exponent),
        local_matches=search.proposals.passed,
        chance=math.exp(search.log_chance),
    )


class _Search:
    """A search for a transform and its state."""

    def __init__(
        self, p: GivenSet, q: GivenSet, target: Target, parameters: TriangleParameters
    ) -> None:
        self.mesh_p, self.mesh_q, self.given, self.target = p.mesh, q.mesh, parameters, target
        self.p = np.array(p.mesh.points.T, order="C")
        self.density_p = density_over_hull(p.mesh, self.p)
        self.move = np.empty(4)
        self.log_chance = self.log_uniform = math.inf
        self.proposals = Proposals(parameters, len(p.mesh), len(q.mesh))
        self.screening = Screening(self.p, target, self.proposals)
        self.verification = Verification(q, self.p, target, self.proposals)
        self.equal_maps, self.refuted = 1, 0
        self.verdicts: dict[int, Verdict] = {}  # by a digest of the partners
        self.maps: list[tuple[float, Ints]] = []  # chance and partners of those that may match

    def run(self) -> bool:
        """Search the triangulations, then one-rings with gaps; return whether it succeeded."""
        return self._search(self.mesh_p.triangles, self.mesh_q.triangles) or self._search(
            ring_triangles(self.mesh_p, self.p), ring_triangles(self.mesh_q, self.target.points)
        )

    def pair(self) -> tuple[Ints, float]:
        """Refit the move to its optimal pairs; return these (K, 2) and their rms distance."""
        partner = optimal_pairs(self.p, self.target.grid, self.move, self.target.pairing_tolerance)
        fit_partners(self.p, self.target.grid, partner, self.move)
        pairs = np.empty((np.count_nonzero(partner >= 0), 2), np.int32)
        return pairs, overlay.list_pairs(self.p, self.target.grid, partner, self.move, pairs)

    def _search(self, of_p: Ints, of_q: Ints) -> bool:
        """Search one kind of triangle, (T, 3) each, until a proposal is accepted."""
        given, proposals, m = self.given, self.proposals, len(self.mesh_p)
        if proposals.at_limit:
            return False
        outliers = (1.0 - given.share) * self.density_p
        in_p = describe_all(self.p, of_p, outliers)
        shortest = given.shortest_side * self.target.spacing
        in_q = describe_large(self.target.points, of_q, given.near_tie, shortest)
        fit = np.empty(8)
        test, *shapes = self._arguments(in_p, in_q, shortest, fit)
        order = in_p.negative_information[: in_p.number].argsort(kind="stable")
        log_tests, log_max = math.log(max(1, in_p.number * in_q.number)), math.log(given.max_chance)
        sufficient = given.sufficient_share * min(m, len(self.mesh_q))
        owner, partner = np.full(len(self.mesh_q), -1, np.int32), np.full(m, -1, np.int32)
        distance2, move = np.empty(m), np.empty(4)
        t2 = self.target.tolerance**2

        def continued(order: NDArray[np.intp], *limits: Any) -> bool:
            return bool(propose(test, order, *shapes, *limits))

        for _ in proposals.passing(continued, order, in_q.number):
            move[:] = _move(fit)
            if self.screening.rejects(move, log_max - log_tests):
                continue
            for _ in range(_BETTER_MAPS):
                inside = overlay.refine(
                    *(self.p, self.target.grid, t2, MAX_ROUNDS),
                    *(owner, partner, distance2, proposals.visits, move),
                )
                if inside < 0:
                    break
                key = hash(partner.tobytes())
                if key not in self.verdicts:
                    verdict = self.verification.judge(
                        move, partner, distance2, inside, log_tests, log_max
                    )
                    self.verdicts[key] = verdict
                    if verdict.log_uniform < log_max / 2:
                        self.maps.append((verdict.log_uniform, partner.copy()))
                verdict = self.verdicts[key]
                if verdict.better is None:
                    break
                move[:] = verdict.better
            if inside < 0:
                continue
            self.equal_maps = max(self.equal_maps, verdict.equal_maps)
            if verdict.has_rivals and verdict.log_chance >= log_max:
                self.refuted += 1
                if self.refuted == _MOST_REFUTED:
                    proposals.end_after(0)
            if verdict.log_uniform < min(self.log_uniform, log_max):
                self.log_uniform, self.log_chance = verdict.log_uniform, verdict.log_chance
                self.move = move.copy()
                if self.log_chance >= log_max:
                    continue
                pairs = np.count_nonzero(partner >= 0)
                is_exact = pairs == m and distance2.mean() < _EXACT * t2
                if is_exact or (self.verification.is_even and pairs >= sufficient):
                    return True
                proposals.end_after(given.extra_proposals)
        return self.log_chance < log_max and not self._is_ambiguous(log_max)

    def _is_ambiguous(self, log_max: float) -> bool:
        """Return whether another map has nearly the evidence of the best; count these.

        At most one is true, so that structure alone gives the evidence of the others.
        """
        near = (one for one in self.maps if one[0] < self.log_uniform - log_max)
        others: list[Ints] = []
        for _, partner in sorted(near, key=itemgetter(0)):
            paired = partner >= 0
            common = (np.count_nonzero(paired & (partner == other)) for other in others)
            if all(2 * number < np.count_nonzero(paired) for number in common):
                others.append(partner)
        self.equal_maps = max(self.equal_maps, len(others))
        return len(others) > 1

    def _arguments(
        self, in_p: TriangleDescriptors, in_q: TriangleDescriptors, shortest: float, fit: Floats
    ) -> tuple[Any, ...]:
        """Return the test of `propose`, and its arguments from the shapes of P on."""
        given, mesh, target = self.given, self.mesh_p, self.target
        shape_tolerance = given.shape_tolerance * target.tolerance
        widest = shape_tolerance / shortest
        test = SimilarityTest(
            *(self.p, in_p.corner, mesh.ring_start, mesh.ring, target.points, target.grid),
            *(*given.of_test(target, len(mesh)), fit, self.proposals.visits),
        )
        shapes = sort_by_shape(in_q, widest)
        return test, in_p.shape, in_q.corner, in_q.side, shapes, shape_tolerance, widest


def _move(fit: Floats) -> tuple[float, float, float, float]:
    """Return the move of a fit (see `_proposal_kernel`)."""
    _, px, py, qx, qy, spread, dot, cross = fit.tolist()
    a, b = dot / spread, cross / spread
    return a, b, qx - a * px + b * py, qy - b * px - a * py

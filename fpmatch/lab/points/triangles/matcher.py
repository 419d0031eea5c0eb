"""The default matcher for bare points: similar triangles propose, a growing neighbourhood decides.

Whole one-rings seldom survive missing points, jitter and outliers; single triangles of the
triangulation often do. Each triangle of P, the most informative first, is compared with the
triangles of Q of nearly its shape. Every such pair proposes a similarity transform, which is tested
on one neighbour after the other and refitted as it grows, so that most false ones are rejected
after a few. A transform that passes is refined over all points, and accepted only where so many
pairs are not expected by chance (a contrario). Where spacings are uneven, chance is that of the
points around each place, and pairs that competing maps find too are hardly evidence.
If no triangle of the triangulation leads to a match, triangles over one-rings with gaps are tried.
The pairs are the best one-to-one pairing.
"""

from __future__ import annotations

import math
from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.points.triangles._overlay_kernel import fit_partners, pair_by_auction
from fpmatch.lab.points.triangles._proposal_kernel import Proposals
from fpmatch.lab.points.triangles.given_set import (
    GivenSet,
    Target,
    check_tolerance,
    density_over_hull,
    describe,
    ring_triangles,
    sort_by_shape,
)
from fpmatch.lab.points.triangles.verification import Verdict, Verification, moved
from fpmatch.pointset.geometry.frames import between_sets
from fpmatch.pointset.geometry.point_match import PointMatch, too_few
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MIN_POINTS_TO_MATCH: Final = 4
"""Smaller sets match too many others to be distinguished from chance."""

MAX_CHANCE: Final = 1e-3
"""Expected number of matches as good by chance, under which a match is accepted."""

MAX_ROUNDS: Final = 12

SHARE: Final = 0.6
"""Share of neighbours that a true transform is supposed to map to points of Q."""

# The sequential test.
_REACH: Final = 0.6  # area in which it seeks a partner, in squared tolerances: few lie far off
_WIDEST: Final = 6.0  # most by which a fit's uncertainty widens that area
_WIDER: Final = np.linspace(1.0, _WIDEST, 33)  # areas, at which the gain of a hit is known
_MIN_CHANCE: Final = 1e-300  # of a hit, where the tolerance is tiny
# Triangles.
_SHAPE_TOLERANCE: Final = 0.75  # tolerances: of the apexes, when the longest sides coincide
_SHORTEST_SIDE: Final = 1.2  # mean spacings: jitter destroys smaller triangles
_NEAR_TIE: Final = 0.8  # Q's triangles are also described by sides of this ratio to the longest
# The end of a search: pairs of triangles, and points tested and overlaid and triangles compared.
_PROPOSALS, _PROPOSALS_PER_POINT = 200_000, 100  # the larger; for each point of the larger set
_VISITS, _VISITS_PER_PROPOSAL = 9_000_000, 16  # the larger; twice those of independent uniform sets
_VISITS_PER_POINT: Final = 400  # as many more for each point of the smaller set
_SUFFICIENT_SHARE: Final = 0.5  # of the smaller set: paired by the first match, it ends the search;
_EXTRA_PROPOSALS: Final = 2_000  # else so many more are tested
_EXACT: Final = 1 / 64  # squared tolerances: nearer pairs end a search among rivals
_MOST_REFUTED: Final = 16  # maps that are no better than their rivals, before a search ends
_BETTER_MAPS: Final = 8  # maps that are judged, at most, where one leads to a better one

_BY_CHANCE: Final = "no transform that was tried pairs more points than expected by chance"


def match_by_triangles(
    p: ArrayLike,
    q: ArrayLike,
    *,
    tolerance: float | None = None,
    max_chance: float = MAX_CHANCE,
    max_proposals: int | None = None,
) -> PointMatch:
    """Find the similarity transform that maps points of P onto points of Q, if there is one.

    This is `fpmatch.match_points` with two parameters more: a match is accepted where fewer than
    `max_chance` as good are expected by chance, and the search ends after `max_proposals` pairs of
    triangles (200,000 by default, or 100 for each point of the larger set). The smaller set is
    mapped onto the larger, unless a tolerance in Q is given. The tolerance is a quarter of the
    spacing of the larger set by default: 1/√density, or less where the second nearest distances are
    smaller than in random points. The search uses at most 0.6 of the mean spacing. Of points that
    coincide, the first is matched.
    """
    check_tolerance(tolerance)
    p_set, q_set = GivenSet("p", p), GivenSet("q", q)
    swapped = tolerance is None and len(p_set) > len(q_set)
    first, second = (q_set, p_set) if swapped else (p_set, q_set)
    if min(len(first), len(second)) < MIN_POINTS_TO_MATCH:
        return PointMatch.none(reason=too_few(MIN_POINTS_TO_MATCH))
    target = Target.of(second, tolerance)
    match = _Search(first, second, target, max_chance, max_proposals).match()
    return match.inverse() if swapped else match


class _Search:
    """A search for a transform and its state."""

    def __init__(
        self,
        p: GivenSet,
        q: GivenSet,
        target: Target,
        max_chance: float,
        max_proposals: int | None,
    ) -> None:
        larger, smaller = max(len(p), len(q)), min(len(p), len(q))
        most = max(_PROPOSALS, _PROPOSALS_PER_POINT * larger)
        self.most = most if max_proposals is None else max_proposals
        self.max_visits = max(_VISITS, _VISITS_PER_PROPOSAL * self.most)
        self.max_visits += _VISITS_PER_POINT * smaller
        self.p, self.q, self.target = p, q, target
        self.log_max = math.log(max_chance)
        self.tried = self.passed = self.refuted = 0
        self.visits = np.zeros(1, np.int64)
        self.verification = Verification(p.points, q, target, self.visits, self.max_visits)
        self.move = np.empty(4)
        self.log_chance = self.log_uniform = math.inf
        self.equal_maps = 1
        self.verdicts: dict[int, Verdict] = {}  # by a digest of the partners
        self.maps: list[tuple[float, Ints]] = []  # chance and partners of those that may match

    @property
    def at_limit(self) -> bool:
        """Whether the search has ended before all proposals were tested."""
        return bool(self.tried >= self.most or self.visits[0] >= self.max_visits)

    def match(self) -> PointMatch:
        """Search the triangulations, then one-rings with gaps; return the match, or why not."""
        p, q, target = self.p, self.q, self.target
        matches = self._search(p.mesh.triangles, q.mesh.triangles) or (
            not self.at_limit
            and self._search(ring_triangles(p.mesh, p.points), ring_triangles(q.mesh, q.points))
        )
        if not matches:
            none = PointMatch.none(self.passed, self._reason())
            return replace(none, equal_maps=self.equal_maps)
        move, t2 = self.move, target.pairing_tolerance**2
        owner, partner = np.full(len(q), -1, np.int32), np.full(len(p), -1, np.int32)
        pair_by_auction(p.points, target.grid, move, t2, owner, partner)
        fit_partners(p.points, target.grid, partner, move)
        paired = np.flatnonzero(partner >= 0)
        in_q = np.asarray(target.grid.order)[partner[paired]]
        off = moved(p.points[:, paired], move) - q.points[:, in_q]
        rms = math.sqrt(float((off * off).sum(axis=0).mean()))
        return PointMatch(
            transform=between_sets(Similarity.of_move(move), p.frame, q.frame),
            pairs=np.column_stack([p.row[paired], q.row[in_q]]).astype(np.int32),
            matched_share=len(paired) / min(len(p), len(q)),
            rms=math.ldexp(rms, q.frame.exponent),
            local_matches=self.passed,
            chance=math.exp(self.log_chance),
        )

    def _reason(self) -> str:
        """Return why there is no match."""
        equal = self.equal_maps
        if equal > 1:
            return f"at least {equal:,} maps fit equally well: which is the true one is not known"
        if self.refuted:
            rows = "the points that pair are on rows or in periods, which other maps pair as well"
            return f"{rows}: {_BY_CHANCE}"
        if self.at_limit:
            return f"{_BY_CHANCE}; the search ended at its limit, after {self.tried:,} proposals"
        return _BY_CHANCE

    def _search(self, of_p: Ints, of_q: Ints) -> bool:
        """Search one kind of triangle, (T, 3) each, until a proposal is accepted.

        The triangles of P come in the order of their information. The log-likelihood ratio of a
        true transform to a false one has a term for each neighbour: a true one brings `SHARE` of
        them onto points of Q, a false one does so by chance.
        """
        p, q, target = self.p, self.q, self.target
        outliers = (1.0 - SHARE) * density_over_hull(p.mesh, p.points)
        shortest = _SHORTEST_SIDE * target.spacing
        in_p = describe(p.points, of_p, outliers=outliers)
        in_q = describe(q.points, of_q, near_tie=_NEAR_TIE, shortest=shortest)
        shape_tolerance = _SHAPE_TOLERANCE * target.tolerance
        widest_shape = shape_tolerance / shortest
        reach2 = _REACH * target.tolerance**2
        chance = np.maximum(-np.expm1(-math.pi * target.density * reach2 * _WIDER), _MIN_CHANCE)
        gain = np.log((SHARE + (1.0 - SHARE) * chance) / chance)
        order = in_p.negative_information[: in_p.number].argsort(kind="stable")
        proposals = Proposals(
            *(p.points, in_p.corner, in_p.shape, order, p.mesh.ring_start, p.mesh.ring),
            *(q.points, target.grid, in_q.corner, in_q.side, sort_by_shape(in_q, widest_shape)),
            *(shape_tolerance, widest_shape, reach2, _WIDEST, gain, math.log(1.0 - SHARE)),
            *(self.tried, self.visits),
        )
        log_tests = math.log(max(1, in_p.number * in_q.number))
        sufficient = _SUFFICIENT_SHARE * min(len(p), len(q))
        while proposals.proceed(self.most, self.max_visits):
            self.passed += 1
            self.tried = int(proposals.tried)
            if self._try(np.array(proposals.move), log_tests, sufficient):
                return True
        self.tried = int(proposals.tried)
        return self.log_chance < self.log_max and not self._is_ambiguous()

    def _try(self, move: Floats, log_tests: float, sufficient: float) -> bool:
        """Refine and judge a move; return whether it ends the search with a match."""
        p, t2 = self.p.points, self.target.tolerance**2
        if self.verification.rejects(move, self.log_max - log_tests):
            return False
        for _ in range(_BETTER_MAPS):
            refined = self.verification.overlay(p, move, MAX_ROUNDS)
            if refined is None:
                return False
            overlaid = refined
            key = hash(overlaid.partner.tobytes())
            if key not in self.verdicts:
                verdict = self.verification.judge(overlaid, log_tests, self.log_max)
                self.verdicts[key] = verdict
                if verdict.log_uniform < self.log_max / 2:
                    self.maps.append((verdict.log_uniform, overlaid.partner))
            verdict = self.verdicts[key]
            if verdict.better is None:
                break
            move = verdict.better
        self.equal_maps = max(self.equal_maps, verdict.equal_maps)
        if verdict.has_rivals and verdict.log_chance >= self.log_max:
            self.refuted += 1
            if self.refuted == _MOST_REFUTED:
                self.most = self.tried
        if verdict.log_uniform >= min(self.log_uniform, self.log_max):
            return False
        self.log_uniform, self.log_chance = verdict.log_uniform, verdict.log_chance
        self.move = overlaid.move
        if self.log_chance >= self.log_max:
            return False
        squared = overlaid.distance2[overlaid.partner >= 0]
        is_exact = len(squared) == p.shape[1] and squared.mean() < _EXACT * t2
        if is_exact or (self.verification.is_even and len(squared) >= sufficient):
            return True
        self.most = min(self.most, self.tried + _EXTRA_PROPOSALS)
        return False

    def _is_ambiguous(self) -> bool:
        """Return whether another map has nearly the evidence of the best; count these.

        At most one is true, so that structure alone gives the evidence of the others.
        """
        near = (one for one in self.maps if one[0] < self.log_uniform - self.log_max)
        others: list[Ints] = []
        for _, partner in sorted(near, key=itemgetter(0)):
            paired = partner >= 0
            common = (np.count_nonzero(paired & (partner == other)) for other in others)
            if all(2 * number < np.count_nonzero(paired) for number in common):
                others.append(partner)
        self.equal_maps = max(self.equal_maps, len(others))
        return len(others) > 1

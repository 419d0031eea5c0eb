"""What searches by proposals from triangles share: parameters, and the tests of a proposal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

import numpy as np

from fpmatch.lab.points.triangles import _overlay_kernel as overlay
from fpmatch.lab.points.triangles._sequential_test_kernel import hit_log_likelihoods
from fpmatch.lab.points.triangles.descriptors import is_even
from fpmatch.lab.points.triangles.given_set import REACHES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from fpmatch.lab.points.triangles.given_set import GivenSet, Target

MAX_CHANCE: Final = 1e-3
"""Expected number of matches as good by chance, under which a match is accepted."""

MAX_ROUNDS: Final = 12

_COMPARED_AT_ONCE: Final = 2_000_000  # triangles of Q, at most, between two reports of progress
_VISITS_PER_PROPOSAL: Final = 16  # twice those of independent uniform sets
_UNSCREENED: Final = 32  # proposals that pass, at least,
_UNSCREENED_POINTS: Final = 500_000  # or with so many points in all: uniform sets have fewer
_SAMPLE: Final = 2_000  # points, at most
_BESIDE: Final = 2.0  # mean spacings: far from partners, near enough for the same density
_DIRECTIONS: Final = 8
_CROWDING: Final = 2.0  # the margin of evidence from a sample
_GAIN_STEPS: Final = 33
_AROUND: Final = 8  # points that tell the density at a place,
_REACH: Final = 2.5  # within so many spacings
_BASES: Final = 4  # points whose nearest neighbours are mapped to other edges,
_MOVES: Final = 3  # to so many each, when rivals are sought
_MANY_MOVES: Final = 256  # and where there are any
_PAIRED: Final = 32  # pairs, at most, that a rival is tried on at first
_ALIKE: Final = 0.25  # tolerances: difference in length of edges as long
_OF_RIVAL: Final = -7.0  # log chance of a rival
_AS_GOOD: Final = 0.9  # share of the log chance
_ROUNDS: Final = 3  # of refining a rival
_MAX_GROWN: Final = 2_000  # neighbours that determine a transform well enough for any set


@dataclass(frozen=True, slots=True)
class SearchParameters:
    """Set the sequential test of proposals, and when a search ends."""

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
    max_chance: float = MAX_CHANCE
    """Expected number of matches as good by chance, under which a match is accepted."""
    sufficient_share: float = 0.5
    """Share of the smaller set with which the first match ends the search, else it goes on."""
    max_proposals: int | None = None
    """Pairs of triangles that are tested, at most; None for the larger of the next two."""
    proposals: int = 200_000
    """Pairs of triangles that are tested, at most, where the sets are small."""
    proposals_per_point: int = 100
    """Those for each point of the larger set, with which the triangles alike in shape grow."""
    max_visits: int = 9_000_000
    """Points tested and overlaid, and triangles compared, at most, where the sets are small."""
    max_visits_per_point: int = 400
    """As many more for each point of the smaller set, which many of them overlay."""
    progress: Callable[[int, int], None] | None = None
    """Called with the pairs of triangles tested so far, and the most, while a search goes on."""

    def most_proposals(self, number: int) -> int:
        """Return the limit of proposals where the larger set has `number` points."""
        if self.max_proposals is not None:
            return self.max_proposals
        return max(self.proposals, self.proposals_per_point * number)

    def most_visits(self, smaller: int, larger: int) -> int:
        """Return the bound of the work of a search of sets of so many points."""
        in_proposals = _VISITS_PER_PROPOSAL * self.most_proposals(larger)
        return max(self.max_visits, in_proposals) + self.max_visits_per_point * smaller

    def of_test(self, target: Target, number: int) -> tuple[Any, ...]:
        """Return the arguments of a `SequentialTest` of `number` points up to the fit."""
        reach2 = self.reach * target.tolerance**2
        gain = np.empty(_GAIN_STEPS)
        miss = hit_log_likelihoods(math.pi * reach2 * target.density, self.share, gain)
        half_of_all = 0.5 * (number - 3) * float(gain[0])
        return (
            *(reach2, gain, miss, self.reject, self.accept, min(self.accept_small, half_of_all)),
            *(self.test_length, np.zeros(number, np.int32)),
            np.empty(min(number, _MAX_GROWN), np.int32),
        )


class _Propose(Protocol):
    """Continue with triangles of P until a proposal passes, as the kernels' `propose` does."""

    def __call__(
        self, order: NDArray[np.intp], most: int, most_visits: int, state: NDArray[np.int_], /
    ) -> bool: ...


class Proposals:
    """Count the work of a search for sets of so many points, and end it at its limit."""

    def __init__(self, given: SearchParameters, number_p: int, number_q: int) -> None:
        self.most = given.most_proposals(max(number_p, number_q))
        self.max_visits = given.most_visits(number_p, max(number_p, number_q))
        self.visits = np.zeros(1, np.int64)
        self.passed = 0
        self._usual = given.proposals, given.max_visits + given.max_visits_per_point * number_p
        self._progress = given.progress
        self._state = np.zeros(3, np.int_)

    @property
    def is_long(self) -> bool:
        """Whether more work was done than the limit for small sets allows."""
        return bool(self._state[2] > self._usual[0] or self.visits[0] > self._usual[1])

    @property
    def at_limit(self) -> bool:
        """Whether the search has ended before all proposals were tested."""
        return bool(self._state[2] >= self.most or self.visits[0] >= self.max_visits)

    @property
    def reason(self) -> str:
        """Why there is no match, where none was found."""
        reason = "no transform that was tried pairs more points than expected by chance"
        if not self.at_limit:
            return reason
        return f"{reason}; the search ended at its limit, after {self._state[2]:,} proposals"

    def end_after(self, proposals: int) -> None:
        """Let the search end after so many more proposals."""
        self.most = min(self.most, int(self._state[2]) + proposals)

    def passing(self, propose: _Propose, order: NDArray[np.intp], number_q: int) -> Iterator[None]:
        """Yield where a proposal passes, for the triangles of P in an order and `number_q` of Q."""
        step = max(1, _COMPARED_AT_ONCE // max(1, number_q))
        for begin in range(0, len(order), step):
            self._state[:2] = 0
            some = order[begin : begin + step]
            while propose(some, self.most, self.max_visits, self._state):
                self.passed += 1
                yield
            if self.at_limit:
                return
            if self._progress is not None:
                self._progress(int(self._state[2]), self.most)


class Screening:
    """Reject transforms by a sample of P before all its points are overlaid and refitted.

    Where points crowd, thousands of false transforms pass the sequential test: each maps its
    neighbourhood into a crowd, in which every place has a point near. The first that pass are not
    screened.
    """

    def __init__(self, points: NDArray[np.float64], target: Target, proposals: Proposals) -> None:
        self._every = int(-(-points.shape[1] // _SAMPLE))
        self._points = np.ascontiguousarray(points[:, :: self._every])
        self._target, self._proposals = target, proposals
        self._owner = np.full(len(target.grid.order), -1, np.int32)
        self._partner = np.full(self._points.shape[1], -1, np.int32)
        self._distance2 = np.empty(self._points.shape[1])
        self._unscreened = max(_UNSCREENED, _UNSCREENED_POINTS // points.shape[1])

    def rejects(self, move: NDArray[np.float64], needed: float) -> bool:
        """Return whether the sample's log chance under a move is above half of what is needed."""
        self._unscreened -= 1
        if self._unscreened >= 0:
            return False
        return self._log_chance(move, self._target.tolerance**2) > needed / 2

    def crowding(self, move: NDArray[np.float64]) -> float:
        """Return the log chance of a match that crowds alone explain; 0 unless a search is long.

        Where the density varies, a wrong transform that maps a crowd onto a crowd pairs more points
        than the mean density predicts, and a long search finds such transforms. They pair as many
        where all points are shifted a little; of a true transform little then remains.
        """
        log_chance = 0.0
        for k in range(_DIRECTIONS if self._proposals.is_long else 0):
            beside, angle = move.copy(), 2 * math.pi * k / _DIRECTIONS
            beside[2] += _BESIDE * self._target.spacing * math.cos(angle)
            beside[-1] += _BESIDE * self._target.spacing * math.sin(angle)
            log_chance = min(log_chance, self._log_chance(beside, self._target.tolerance**2 / 2))
        return _CROWDING * self._every * log_chance

    def _log_chance(self, move: NDArray[np.float64], t2: float) -> float:
        """Return the log chance of the sample's pairs under a move, infinite for next to none."""
        inside = overlay.refine(
            *(self._points, self._target.grid, t2, 1, self._owner, self._partner),
            *(self._distance2, self._proposals.visits, move.copy()),
        )
        if inside < 0:
            return math.inf
        arrays, determined = (self._partner, self._distance2, inside), len(move) // 2
        t2 = self._target.tolerance**2
        return float(overlay.log_chance(*arrays, t2, self._target.rate, determined))


class Verdict(NamedTuple):
    """How likely a map is by chance, and how many maps are as good."""

    log_chance: float
    equal_maps: int = 1
    better: NDArray[np.float64] | None = None  # a map that pairs more
    has_rivals: bool = False


class Verification:
    """Judge maps by the points around each place, and by the maps that compete with them.

    A rival is a map of a point of P and its nearest neighbour onto two other neighbours in Q as
    far apart, which itself pairs more points than chance does: one that shifts a row along itself
    or turns a grid. What rivals pair too is hardly evidence.
    """

    def __init__(
        self,
        q: GivenSet,
        points: NDArray[np.float64],
        target: Target,
        proposals: Proposals,
    ):
        self._mesh_q, self._points, self._target = q.mesh, points, target
        self._t2 = target.tolerance**2
        self._owner = np.full(len(q), -1, np.int32)
        self.is_even: bool | None = None
        self._proposals, self._visits = proposals, proposals.visits

    def judge(
        self,
        move: NDArray[np.float64],
        partner: NDArray[np.int32],
        distance2: NDArray[np.float64],
        inside: int,
        log_tests: float,
        log_max: float,
    ) -> Verdict:
        """Return the verdict on a refined move, with its partners and their squared distances."""
        chance = log_tests + float(
            overlay.log_chance(partner, distance2, inside, self._t2, self._target.rate)
        )
        if chance >= 0.0:
            return Verdict(chance)
        target, grid = self._target, self._target.grid
        if self.is_even is None:
            target = self._target
            self.is_even = is_even(self._mesh_q, target.points, target.density)
        if self.is_even:
            return Verdict(chance)
        every = -(-len(partner) // _SAMPLE)
        each, rate = np.empty((REACHES, -(-len(partner) // every))), np.empty(REACHES)
        near, apart2 = np.empty(_AROUND + 1, np.int32), np.empty(_AROUND + 1)
        reach2 = (_REACH * target.spacing) ** 2
        count = overlay.local_rates(
            *(self._points, grid, move, partner, every, reach2, self._t2),
            *(near, apart2, each, rate),
        )
        chance = log_tests + float(overlay.log_chance(partner, distance2, inside, self._t2, rate))
        if chance >= log_max:
            return Verdict(chance)
        paired = (partner >= 0).nonzero()[0]
        moves, _ = self._moves(move, partner, paired, _MOVES)
        some = paired[:: -(-len(paired) // _PAIRED)]
        known = partner[some]
        needed = _OF_RIVAL - math.log(max(1, len(moves)))
        room = np.full(len(some), -1, np.int32), np.empty(len(some)), self._visits
        sample = np.ascontiguousarray(self._points[:, some])
        self._owner[:] = -1
        if not overlay.has_rival(
            sample, grid, self._t2, rate, needed, moves, known, self._owner, *room
        ):
            return Verdict(chance)
        return self._against_rivals(move, partner, paired, (each[:, :count], rate), chance)

    def _moves(
        self,
        move: NDArray[np.float64],
        partner: NDArray[np.int32],
        paired: NDArray[np.intp],
        most: int,
    ) -> tuple[NDArray[np.float64], int]:
        """Return moves of some paired points and neighbours onto other edges, most of one."""
        moves, first, largest = np.empty((_BASES * (most + 1), 4)), 0, 0
        apart, target = np.empty(most), self._target
        bases = paired[:: -(-len(paired) // _BASES)]
        for i, beside in zip(bases, self._beside(self._points, partner)[bases], strict=True):
            count = overlay.rival_moves(
                *(self._points, target.grid, partner, i, beside, target.points),
                *(self._mesh_q.ring_start, self._mesh_q.ring),
                *(move, _ALIKE * target.tolerance, apart, moves, first),
            )
            first, largest = first + count, max(largest, count)
        return moves[:first], largest

    def _against_rivals(
        self,
        move: NDArray[np.float64],
        partner: NDArray[np.int32],
        paired: NDArray[np.intp],
        local: tuple[NDArray[np.float64], NDArray[np.float64]],
        chance: float,
    ) -> Verdict:
        """Return the verdict on a move that has rivals.

        A rival that pairs a point's neighbour, and the point too, explains the point.
        """
        each, rate = local
        every = -(-len(partner) // _SAMPLE)
        points = np.ascontiguousarray(self._points[:, ::every])
        ours = self._overlay(points, move.copy(), rate)
        if ours is None:
            return Verdict(chance)
        value, mine, apart2, is_inside = ours
        moves, alike = self._moves(move, partner, paired, _MANY_MOVES)
        rivals: dict[bytes, tuple[float, int, NDArray[np.float64], NDArray[np.float64]]] = {}
        number = np.count_nonzero(mine >= 0)
        for other in moves:
            if self._proposals.at_limit:
                break
            overlaid = self._overlay(points, other, rate)
            if overlaid is None or overlaid[0] + math.log(len(moves)) >= _OF_RIVAL:
                continue
            theirs = overlaid[1]
            pairs = int(np.count_nonzero(theirs >= 0))
            if 2 * np.count_nonzero((theirs == mine) & (theirs >= 0)) < pairs:
                rivals[theirs.tobytes()] = (
                    overlaid[0],
                    pairs,
                    np.where(theirs >= 0, overlaid[2], np.inf),
                    other,
                )
        if not rivals:
            return Verdict(chance)
        best = sorted(rivals.values(), key=lambda rival: rival[0])
        if best[0][1] > number and best[0][0] < value - 1:
            return Verdict(0.0, 1, best[0][3], has_rivals=True)
        equal = sum(bool(pairs >= number and v <= _AS_GOOD * value) for v, pairs, *_ in best)
        if equal:
            return Verdict(0.0, 1 + equal, has_rivals=True)
        theirs2 = np.array([rival[2] for rival in best])
        beside = self._beside(points, mine)
        hit, apart2 = (mine >= 0)[is_inside], apart2[is_inside]
        least = 0.0
        for part in range(REACHES):
            reach2 = self._t2 / 4**part
            hits = int(np.count_nonzero(hit & (apart2 <= reach2)))
            within = theirs2 <= reach2
            both = (within & within[:, beside]).sum(axis=0)
            shares = (both / np.maximum(1, within[:, beside].sum(axis=0)))[is_inside]
            least = min(least, _log_tail(np.maximum(each[part], shares), hits))
        of_structure = math.log(REACHES * 2 * max(1, alike)) + every * least
        return Verdict(max(chance, of_structure), has_rivals=True)

    @staticmethod
    def _beside(points: NDArray[np.float64], mine: NDArray[np.int32]) -> NDArray[np.intp]:
        """Return the nearest point with a partner of each point."""
        from scipy.spatial import KDTree  # noqa: PLC0415

        paired = (mine >= 0).nonzero()[0]
        two = np.asarray(KDTree(points.T[paired]).query(points.T, k=2)[1])
        own = paired[two[:, 0]] == np.arange(len(mine))
        return np.asarray(paired[np.where(own, two[:, 1], two[:, 0])])

    def _overlay(
        self, points: NDArray[np.float64], move: NDArray[np.float64], rate: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.int32], NDArray[np.float64], NDArray[np.bool_]] | None:
        """Refine a move; return its log chance, partners, squared distances and who is inside."""
        partner, distance2 = np.full(points.shape[1], -1, np.int32), np.full(points.shape[1], 1.0)
        self._owner[:] = -1
        inside = overlay.refine(
            *(points, self._target.grid, self._t2, _ROUNDS),
            *(self._owner, partner, distance2, self._visits, move),
        )
        if inside < 0:
            return None
        grid, (a, b, tx, ty) = self._target.grid, move.tolist()
        x, y = a * points[0] - b * points[1] + tx, b * points[0] + a * points[1] + ty
        is_inside = (x >= grid.x0) & (y >= grid.y0) & (x <= grid.x1) & (y <= grid.y1)
        value = float(overlay.log_chance(partner, distance2, inside, self._t2, rate))
        return value, partner, distance2, is_inside


def _log_tail(chance: NDArray[np.float64], hits: int) -> float:
    """Return Chernoff's bound of so many hits of points that hit with a chance each, as a log."""
    if hits <= chance.sum():
        return 0.0
    tilt = np.exp(np.linspace(0.0, 40.0, 81))[:, None]
    bound = np.log1p(chance * (tilt - 1.0)).sum(axis=1) - hits * np.log(tilt[:, 0])
    return float(bound.min())

"""The verdict on a map of point sets: its chance, and the maps that compete with it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.points.triangles import _overlay_kernel as overlay
from fpmatch.lab.points.triangles.descriptors import is_even
from fpmatch.lab.points.triangles.given_set import REACHES
from fpmatch.lab.points.triangles.search import SAMPLE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.points.triangles.given_set import GivenSet, Target
    from fpmatch.lab.points.triangles.search import Proposals

_AROUND: Final = 8  # points that tell the density at a place,
_REACH: Final = 2.5  # within so many spacings
_BASES: Final = 4  # points whose nearest neighbours are mapped to other edges,
_SHIFTS: Final = 8
_MOVES: Final = 3  # to so many each, when rivals are sought
_MANY_MOVES: Final = 256  # and where there are any
_PAIRED: Final = 32  # pairs, at most, that a rival is tried on at first
_ALIKE: Final = 0.25  # tolerances: difference in length of edges as long
_OF_RIVAL: Final = -7.0  # log chance of a rival
_AS_GOOD: Final = 0.9  # share of the log chance
_ROUNDS: Final = 3  # of refining a rival


class Verdict(NamedTuple):
    """How likely a map is by chance, and how many maps are as good."""

    log_chance: float
    log_uniform: float  # the same, without what competing maps pair
    equal_maps: int = 1
    better: NDArray[np.float64] | None = None  # a map that pairs more
    has_rivals: bool = False


class _Overlaid(NamedTuple):
    """The points under a map: its log chance, partners, squared distances and who is inside."""

    log_chance: float
    partner: NDArray[np.int32]
    distance2: NDArray[np.float64]
    is_inside: NDArray[np.bool_]


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
        self._owner = np.empty(0, np.int32)
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
            return Verdict(chance, chance)
        target, grid = self._target, self._target.grid
        if self.is_even is None:
            self.is_even = is_even(self._mesh_q, target.points, target.density)
        if self.is_even:
            return Verdict(chance, chance)
        every = -(-len(partner) // SAMPLE)
        rate = self._local_rates(self._points, move, partner, every)[1]
        chance = log_tests + float(overlay.log_chance(partner, distance2, inside, self._t2, rate))
        if chance >= log_max:
            return Verdict(chance, chance)
        paired = (partner >= 0).nonzero()[0]
        moves, _ = self._moves(move, partner, paired, _MOVES)
        some = paired[:: -(-len(paired) // _PAIRED)]
        known = partner[some]
        room = np.full(len(some), -1, np.int32), np.empty(len(some)), self._visits
        sample = np.ascontiguousarray(self._points[:, some])
        self._owner = np.full(len(self._mesh_q), -1, np.int32)
        if not overlay.has_rival(
            sample, grid, self._t2, rate, _OF_RIVAL, moves, known, self._owner, *room
        ):
            return Verdict(chance, chance)
        return self._against_rivals(move, partner, paired, rate, chance)

    def _local_rates(
        self,
        points: NDArray[np.float64],
        move: NDArray[np.float64],
        partner: NDArray[np.int32],
        every: int,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the chance of a partner of each point inside, (REACHES, inside), and the means."""
        each, rate = np.empty((REACHES, -(-len(partner) // every))), np.empty(REACHES)
        near, apart2 = np.empty(_AROUND + 1, np.int32), np.empty(_AROUND + 1)
        reach2 = (_REACH * self._target.spacing) ** 2
        count = overlay.local_rates(
            *(points, self._target.grid, move, partner, every, reach2, self._t2),
            *(near, apart2, each, rate),
        )
        return each[:, :count], rate

    def _moves(
        self,
        move: NDArray[np.float64],
        partner: NDArray[np.int32],
        paired: NDArray[np.intp],
        most: int,
    ) -> tuple[NDArray[np.float64], int]:
        """Return moves of some paired points and neighbours onto other edges, most of one."""
        moves, first, largest = np.empty((_BASES * (most + _SHIFTS), 4)), 0, 0
        apart, target = np.empty(most), self._target
        bases = paired[:: -(-len(paired) // _BASES)]
        for i, beside in zip(bases, self._beside(self._points, partner)[bases], strict=True):
            count = overlay.rival_moves(
                *(self._points, target.grid, partner, i, beside, target.points),
                *(self._mesh_q.ring_start, self._mesh_q.ring),
                *(move, _SHIFTS, _ALIKE * target.tolerance, apart, moves, first),
            )
            first, largest = first + count, max(largest, count)
        return moves[:first], largest

    def _against_rivals(
        self,
        move: NDArray[np.float64],
        partner: NDArray[np.int32],
        paired: NDArray[np.intp],
        rate: NDArray[np.float64],
        chance: float,
    ) -> Verdict:
        """Return the verdict on a move that has rivals.

        A rival that pairs a point's neighbour, and the point too, explains the point: as it is, or
        refined, for a fit to all pairs may spoil exact ones.
        """
        every = -(-len(partner) // SAMPLE)
        points, own = np.ascontiguousarray(self._points[:, ::every]), move.copy()
        ours = self._overlay(points, own, rate)
        if ours is None:
            return Verdict(chance, chance)
        value, mine, apart2, is_inside = ours
        moves, alike = self._moves(move, partner, paired, _MANY_MOVES)
        rivals: dict[bytes, tuple[float, int, NDArray[np.float64], NDArray[np.float64]]] = {}
        number = np.count_nonzero(mine >= 0)
        for other in moves:
            if self._proposals.at_limit:
                break
            given = self._overlay(points, other.copy(), rate, rounds=1)
            overlaid = self._overlay(points, other, rate)
            if given is None or overlaid is None or overlaid[0] >= _OF_RIVAL:
                continue
            theirs = overlaid[1]
            pairs = int(np.count_nonzero(theirs >= 0))
            if 2 * np.count_nonzero((theirs == mine) & (theirs >= 0)) < pairs:
                rivals[theirs.tobytes()] = (
                    overlaid[0],
                    pairs,
                    np.minimum(_distances2(given), _distances2(overlaid)),
                    other,
                )
        if not rivals:
            return Verdict(chance, chance)
        best = sorted(rivals.values(), key=lambda rival: rival[0])
        if best[0][1] > number and best[0][0] < value - 1:
            return Verdict(0.0, chance, 1, best[0][3], has_rivals=True)
        equal = sum(bool(pairs >= number and v <= _AS_GOOD * value) for v, pairs, *_ in best)
        if equal:
            return Verdict(0.0, chance, 1 + equal, has_rivals=True)
        theirs2 = np.array([rival[2] for rival in best])
        beside = self._beside(points, mine)
        each = self._local_rates(points, own, mine, 1)[0]
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
        return Verdict(max(chance, of_structure), chance, has_rivals=True)

    @staticmethod
    def _beside(points: NDArray[np.float64], mine: NDArray[np.int32]) -> NDArray[np.intp]:
        """Return the nearest point with a partner of each point."""
        from scipy.spatial import KDTree  # noqa: PLC0415

        paired = (mine >= 0).nonzero()[0]
        two = np.asarray(KDTree(points.T[paired]).query(points.T, k=2)[1])
        own = paired[two[:, 0]] == np.arange(len(mine))
        return np.asarray(paired[np.where(own, two[:, 1], two[:, 0])])

    def _overlay(
        self,
        points: NDArray[np.float64],
        move: NDArray[np.float64],
        rate: NDArray[np.float64],
        rounds: int = _ROUNDS,
    ) -> _Overlaid | None:
        """Refine a move in place; return what it pairs, None where it does not determine a map."""
        partner, distance2 = np.full(points.shape[1], -1, np.int32), np.full(points.shape[1], 1.0)
        self._owner[:] = -1
        inside = overlay.refine(
            *(points, self._target.grid, self._t2, rounds),
            *(self._owner, partner, distance2, self._visits, move),
        )
        if inside < 0:
            return None
        grid, (a, b, tx, ty) = self._target.grid, move.tolist()
        x, y = a * points[0] - b * points[1] + tx, b * points[0] + a * points[1] + ty
        is_inside = (x >= grid.x0) & (y >= grid.y0) & (x <= grid.x1) & (y <= grid.y1)
        value = float(overlay.log_chance(partner, distance2, inside, self._t2, rate))
        return _Overlaid(value, partner, distance2, is_inside)


def _distances2(overlaid: _Overlaid) -> NDArray[np.float64]:
    """Return the squared distances of pairs, infinite for points without a partner."""
    return np.where(overlaid.partner >= 0, overlaid.distance2, np.inf)


def _log_tail(chance: NDArray[np.float64], hits: int) -> float:
    """Return Chernoff's bound of so many hits of points that hit with a chance each, as a log."""
    if hits <= chance.sum():
        return 0.0
    tilt = np.exp(np.linspace(0.0, 40.0, 81))[:, None]
    bound = np.log1p(chance * (tilt - 1.0)).sum(axis=1) - hits * np.log(tilt[:, 0])
    return float(bound.min())

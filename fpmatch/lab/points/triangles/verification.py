"""The verdict on a map of point sets: its chance, and the maps that compete with it."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.points.triangles._overlay_kernel import refine
from fpmatch.lab.points.triangles.given_set import REACHES, is_even

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.spatial import KDTree

    from fpmatch.lab.points.triangles.given_set import GivenSet, Target

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]
    Counts = NDArray[np.int64]

SAMPLE: Final = 2_000  # points, at most
_AROUND: Final = 8  # points that tell the density at a place,
_REACH: Final = 2.5  # within so many spacings
_FLAT: Final = 0.2  # of second moments: points along a line
_BASES: Final = 4  # points whose nearest neighbours are mapped to other edges,
_SHIFTS: Final = 8
_MOVES: Final = 3  # to so many each, when rivals are sought
_MANY_MOVES: Final = 256  # and where there are any
_PAIRED: Final = 32  # pairs, at most, that a rival is tried on at first
_ALIKE: Final = 0.25  # tolerances: difference in length of edges as long
_OF_RIVAL: Final = -7.0  # log chance of a rival
_AS_GOOD: Final = 0.9  # share of the log chance
_ROUNDS: Final = 3  # of refining a rival
_UNSCREENED: Final = 32  # maps that pass, at least,
_UNSCREENED_POINTS: Final = 500_000  # or with so many points in all: uniform sets have fewer


class Verdict(NamedTuple):
    """How likely a map is by chance, and how many maps are as good."""

    log_chance: float
    log_uniform: float  # the same, without what competing maps pair
    equal_maps: int = 1
    better: Floats | None = None  # a map that pairs more
    has_rivals: bool = False


class Overlaid(NamedTuple):
    """Points under a map, and which of them have partners."""

    move: Floats  # (4,), refined
    partner: Ints  # (N,), in the order of the grid; -1 for none
    distance2: Floats  # (N,), squared distances of partners, infinite where there is none
    inside: int  # points within the grid

    def log_chance(self, t2: float, rate: Floats) -> float:
        """Return the log of the probability that so many of the points have partners by chance.

        Chernoff's bound on the binomial tail, at each of `REACHES`, where a point finds one with
        the probability `rate`; the least counts, corrected for the number of reaches. So near pairs
        are more significant than far ones, and a few exact ones as significant as many rough ones.
        Two pairs determine the transform.
        """
        pairs = (self.distance2 <= t2 * REACHES[:, None]).sum(axis=1)
        trials = self.inside - 2
        share = np.maximum(pairs - 2, 0) / max(trials, 1)
        counts = (share > rate) & (rate > 0.0)
        share, rate = share[counts], rate[counts]
        if not len(share):
            return 0.0
        miss = 1.0 - share
        exponent = share * np.log(share / rate)
        exponent += miss * (np.log(np.maximum(miss, 1e-300)) - np.log1p(-rate))
        return min(0.0, math.log(len(REACHES)) - trials * float(exponent.max()))


class Verification:
    """Judge maps by the points around each place, and by the maps that compete with them.

    A rival is a map of a point of P and its nearest neighbour onto two other neighbours in Q as
    far apart, which itself pairs more points than chance does: one that shifts a row along itself
    or turns a grid. What rivals pair too is hardly evidence. `visits` (1,) counts the points
    overlaid, of which there are `most` at most.
    """

    def __init__(self, p: Floats, q: GivenSet, target: Target, visits: Counts, most: int) -> None:
        self._mesh_q, self._points, self._target = q.mesh, p, target
        self._t2 = target.tolerance**2
        self._owner = np.full(len(q), -1, np.int32)
        self._visits, self._most_visits = visits, most
        self._every = -(-p.shape[1] // SAMPLE)
        self._sample = np.ascontiguousarray(p[:, :: self._every])
        self._unscreened = max(_UNSCREENED, _UNSCREENED_POINTS // p.shape[1])

    @cached_property
    def is_even(self) -> bool:
        """Whether Q's points are spread as evenly as random ones."""
        return is_even(self._mesh_q, self._target.points, self._target.crowding)

    def overlay(self, points: Floats, move: Floats, rounds: int) -> Overlaid | None:
        """Refine a move of points (2, N); None where these pairs do not determine one."""
        n, move = points.shape[1], np.array(move)
        partner, distance2 = np.full(n, -1, np.int32), np.empty(n)
        inside = refine(
            *(points, self._target.grid, self._t2, rounds, self._owner),
            *(partner, distance2, self._visits, move),
        )
        self._owner[partner[partner >= 0]] = -1
        distance2[partner < 0] = np.inf
        return None if inside < 0 else Overlaid(move, partner, distance2, inside)

    def rejects(self, move: Floats, needed: float) -> bool:
        """Return whether a sample's log chance under a move is above half of what is `needed`.

        Where points crowd, thousands of false transforms pass the sequential test: each maps its
        neighbourhood into a crowd, in which every place has a point near. The first that pass are
        not screened.
        """
        self._unscreened -= 1
        if self._unscreened >= 0:
            return False
        overlaid = self.overlay(self._sample, move, rounds=1)
        return overlaid is None or overlaid.log_chance(self._t2, self._target.rate) > needed / 2

    def judge(self, overlaid: Overlaid, log_tests: float, log_max: float) -> Verdict:
        """Return the verdict on a map of all points."""
        chance = log_tests + overlaid.log_chance(self._t2, self._target.rate)
        if chance >= 0.0 or self.is_even:
            return Verdict(chance, chance)
        partner = overlaid.partner
        at = slice(None, None, self._every)
        rate = self._local_rates(self._sample, overlaid.move, partner[at])[1].mean(axis=1)
        chance = log_tests + overlaid.log_chance(self._t2, rate)
        if chance >= log_max:
            return Verdict(chance, chance)
        paired = np.flatnonzero(partner >= 0)
        moves, _ = self._rival_moves(overlaid, paired, _MOVES)
        some = paired[:: -(-len(paired) // _PAIRED)]
        sample = np.ascontiguousarray(self._points[:, some])
        for move in moves:
            rival = self.overlay(sample, move, rounds=1)
            if rival and self._competes(rival, partner[some], rate):
                return self._against_rivals(overlaid, paired, rate, chance)
        return Verdict(chance, chance)

    def _competes(self, rival: Overlaid, known: Ints, rate: Floats) -> bool:
        """Return whether a rival pairs more than chance does, and mostly others than the known."""
        if rival.log_chance(self._t2, rate) >= _OF_RIVAL:
            return False
        paired = rival.partner >= 0
        common = np.count_nonzero(paired & (rival.partner == known))
        return bool(2 * common < np.count_nonzero(paired))

    def _local_rates(
        self, points: Floats, move: Floats, partner: Ints
    ) -> tuple[NDArray[np.bool_], Floats]:
        """Return who is inside the grid, and the chance of a partner there, (REACHES, inside).

        The density at a moved point is that of an ellipse: the second moments of the nearest points
        of Q, without the partner. No axis is shorter than half a reach; points along a line count
        by its length.
        """
        grid = self._target.grid
        x, y = there = moved(points, move)
        is_inside = (x >= grid.x0) & (y >= grid.y0) & (x <= grid.x1) & (y <= grid.y1)
        there, partner = there[:, is_inside], partner[is_inside]
        wide2, r2 = (_REACH * self._target.spacing) ** 2, self._t2 * REACHES[:, None]
        near = self._tree.query(there.T, _AROUND + 1, distance_upper_bound=math.sqrt(wide2))[1]
        other = (near < len(grid.order)) & (near != partner[:, None])
        other[other.all(axis=1), -1] = False
        at = np.minimum(near, len(grid.order) - 1)
        dx = np.where(other, np.asarray(grid.x)[at] - there[0][:, None], 0.0)
        dy = np.where(other, np.asarray(grid.y)[at] - there[1][:, None], 0.0)
        number = other.sum(axis=1)
        few, number = number < 3, number + (number < 3)
        xx, yy, xy = ((a * b).sum(axis=1) / number for a, b in ((dx, dx), (dy, dy), (dx, dy)))
        trace = np.where(few, 0.5 * wide2, xx + yy)
        det = np.where(few, 0.0625 * wide2 * wide2, xx * yy - xy * xy)
        spread = np.sqrt(np.maximum(det, 0.0) + 0.25 * r2 * trace + 0.0625 * r2 * r2)
        expected = number * r2 / (4.0 * spread)
        farthest2 = np.where(few, wide2, (dx * dx + dy * dy).max(axis=1))
        on_line = number * np.sqrt(r2 / farthest2)
        flat = 4.0 * det < _FLAT * trace * trace
        return is_inside, -np.expm1(-np.where(flat, np.maximum(expected, on_line), expected))

    @cached_property
    def _tree(self) -> KDTree:
        """Q's points in the order of the grid."""
        from scipy.spatial import KDTree  # noqa: PLC0415

        return KDTree(np.column_stack([self._target.grid.x, self._target.grid.y]))

    def _rival_moves(
        self, overlaid: Overlaid, paired: NDArray[np.intp], most: int
    ) -> tuple[Floats, int]:
        """Return moves (K, 4) that compete with one, and the most that are onto edges of Q.

        Some paired points are shifted to the neighbours of their partners. Each of these and the
        nearest paired point are mapped to other edges of Q as long, `most` of them: those whose
        lengths differ least.
        """
        mesh, order = self._mesh_q, np.asarray(self._target.grid.order)
        p, q = (of[0] + 1j * of[1] for of in (self._points, self._target.points))
        start, end = np.repeat(np.arange(len(mesh)), np.diff(mesh.ring_start)), mesh.ring
        edge = q[end] - q[start]
        a, b, tx, ty = overlaid.move.tolist()
        known, shift = complex(a, b), complex(tx, ty)
        linear, shifts, largest = [], [], 0
        bases = paired[:: -(-len(paired) // _BASES)]
        for i, beside in zip(bases, self._beside(self._points, paired)[bases], strict=True):
            c, d = order[overlaid.partner[[i, beside]]]
            near = mesh.one_ring(int(c))[:_SHIFTS]
            linear.append(np.full(len(near), known))
            shifts.append(shift + q[near] - q[c])
            off = abs(abs(edge) - abs(q[d] - q[c]))
            off[(start == c) & (end == d)] = np.inf
            alike = np.flatnonzero(off <= _ALIKE * self._target.tolerance)
            alike = alike[off[alike].argsort(kind="stable")[:most]]
            linear.append(edge[alike] / (p[beside] - p[i]))
            shifts.append(q[start[alike]] - linear[-1] * p[i])
            largest = max(largest, len(near) + len(alike))
        u, t = np.concatenate(linear), np.concatenate(shifts)
        return np.column_stack([u.real, u.imag, t.real, t.imag]), largest

    def _against_rivals(
        self, overlaid: Overlaid, paired: NDArray[np.intp], rate: Floats, chance: float
    ) -> Verdict:
        """Return the verdict on a move that has rivals.

        A rival that pairs a point's neighbour, and the point too, explains the point: as it is, or
        refined, for a fit to all pairs may spoil exact ones.
        """
        points = self._sample
        ours = self.overlay(points, overlaid.move, _ROUNDS)
        if ours is None:
            return Verdict(chance, chance)
        value, mine = ours.log_chance(self._t2, rate), ours.partner
        moves, alike = self._rival_moves(overlaid, paired, _MANY_MOVES)
        rivals: dict[bytes, tuple[float, int, Floats, Floats]] = {}
        for move in moves:
            if self._visits[0] >= self._most_visits:
                break
            given = self.overlay(points, move, rounds=1)
            rival = self.overlay(points, move, _ROUNDS)
            if given and rival and self._competes(rival, mine, rate):
                rivals[rival.partner.tobytes()] = (
                    rival.log_chance(self._t2, rate),
                    int(np.count_nonzero(rival.partner >= 0)),
                    np.minimum(given.distance2, rival.distance2),
                    rival.move,
                )
        if not rivals:
            return Verdict(chance, chance)
        best = sorted(rivals.values(), key=lambda rival: rival[0])
        number = np.count_nonzero(mine >= 0)
        if best[0][1] > number and best[0][0] < value - 1:
            return Verdict(0.0, chance, 1, best[0][3], has_rivals=True)
        equal = sum(bool(pairs >= number and v <= _AS_GOOD * value) for v, pairs, *_ in best)
        if equal:
            return Verdict(0.0, chance, 1 + equal, has_rivals=True)
        theirs2 = np.array([rival[2] for rival in best])
        beside = self._beside(points, np.flatnonzero(mine >= 0))
        is_inside, rates = self._local_rates(points, ours.move, mine)
        least = 0.0
        for each, share in zip(rates, REACHES, strict=True):
            hits = int(np.count_nonzero(ours.distance2[is_inside] <= share * self._t2))
            within = theirs2 <= share * self._t2
            both = (within & within[:, beside]).sum(axis=0)
            shares = (both / np.maximum(1, within[:, beside].sum(axis=0)))[is_inside]
            least = min(least, _log_tail(np.maximum(each, shares), hits))
        of_structure = math.log(len(REACHES) * 2 * max(1, alike)) + self._every * least
        return Verdict(max(chance, of_structure), chance, has_rivals=True)

    @staticmethod
    def _beside(points: Floats, paired: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the nearest point with a partner of each point."""
        from scipy.spatial import KDTree  # noqa: PLC0415

        two = np.asarray(KDTree(points.T[paired]).query(points.T, k=2)[1])
        own = paired[two[:, 0]] == np.arange(points.shape[1])
        return np.asarray(paired[np.where(own, two[:, 1], two[:, 0])])


def moved(points: Floats, move: Floats) -> Floats:
    """Return points (2, N) under a move."""
    a, b, tx, ty = move
    return np.array([a * points[0] - b * points[1] + tx, b * points[0] + a * points[1] + ty])


def _log_tail(chance: Floats, hits: int) -> float:
    """Return Chernoff's bound of so many hits of points that hit with a chance each, as a log."""
    if hits <= chance.sum():
        return 0.0
    tilt = np.exp(np.linspace(0.0, 40.0, 81))[:, None]
    bound = np.log1p(chance * (tilt - 1.0)).sum(axis=1) - hits * np.log(tilt[:, 0])
    return float(bound.min())

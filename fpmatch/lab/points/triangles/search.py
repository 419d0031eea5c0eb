"""What searches by proposals from triangles share: parameters, and the tests of a proposal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from fpmatch.lab.points.triangles import _overlay_kernel as overlay
from fpmatch.lab.points.triangles._sequential_test_kernel import hit_log_likelihoods

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from fpmatch.lab.points.triangles.given_set import Target

MAX_CHANCE: Final = 1e-3
"""Expected number of matches as good by chance, under which a match is accepted."""

MAX_ROUNDS: Final = 12

_COMPARED_AT_ONCE: Final = 2_000_000  # triangles of Q, at most, between two reports of progress
_VISITS_PER_PROPOSAL: Final = 16  # twice those of independent uniform sets
_UNSCREENED: Final = 32  # proposals that pass, at least,
_UNSCREENED_POINTS: Final = 500_000  # or with so many points in all: uniform sets have fewer
SAMPLE: Final = 2_000  # points, at most
_GAIN_STEPS: Final = 33
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
        self._progress = given.progress
        self._state = np.zeros(3, np.int_)

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
        self._every = int(-(-points.shape[1] // SAMPLE))
        self._points, self._target, self._proposals = points, target, proposals
        self._unscreened = max(_UNSCREENED, _UNSCREENED_POINTS // points.shape[1])

    def rejects(self, move: NDArray[np.float64], needed: float) -> bool:
        """Return whether the sample's log chance under a move is above half of what is needed."""
        self._unscreened -= 1
        if self._unscreened >= 0:
            return False
        sample, owner, partner, distance2 = self._room
        t2 = self._target.tolerance**2
        inside = overlay.refine(
            *(sample, self._target.grid, t2, 1, owner, partner),
            *(distance2, self._proposals.visits, move.copy()),
        )
        if inside < 0:
            return True
        chance = overlay.log_chance(partner, distance2, inside, t2, self._target.rate)
        return bool(chance > needed / 2)

    @cached_property
    def _room(self) -> tuple[NDArray[Any], ...]:
        """The sample (2, n), and room for the owners, the partners and their distances."""
        sample = np.ascontiguousarray(self._points[:, :: self._every])
        owner = np.full(len(self._target.grid.order), -1, np.int32)
        n = sample.shape[1]
        return sample, owner, np.full(n, -1, np.int32), np.empty(n)

"""What searches by proposals from triangles share: parameters, and the tests of a proposal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.pointset.triangles import _overlay_kernel as overlay
from fpmatch.pointset.triangles._sequential_test_kernel import hit_log_likelihoods

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.given_set import Target

MAX_CHANCE: Final = 1e-3
"""Expected number of matches as good by chance, under which a match is accepted."""

MAX_ROUNDS: Final = 12

_UNSCREENED: Final = 32  # proposals that pass, at least,
_UNSCREENED_POINTS: Final = 500_000  # or with so many points in all: uniform sets have fewer
_SAMPLE: Final = 2_000  # points, at most
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
    max_visits: int = 9_000_000
    """Points tested and overlaid, and triangles compared, at most."""
    max_visits_per_point: int = 400
    """As many more for each point of the smaller set, which many of them overlay."""

    def most_visits(self, number: int) -> int:
        """Return the bound of the work of a search for `number` points."""
        return self.max_visits + self.max_visits_per_point * number

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


class Screening:
    """Reject transforms by a sample of P before all its points are overlaid and refitted.

    Where points crowd, thousands of false transforms pass the sequential test: each maps its
    neighbourhood into a crowd, in which every place has a point near. The first that pass are not
    screened.
    """

    def __init__(
        self, points: NDArray[np.float64], target: Target, visits: NDArray[np.int64]
    ) -> None:
        every = -(-points.shape[1] // _SAMPLE)
        self._points = np.ascontiguousarray(points[:, ::every])
        self._target, self._visits = target, visits
        self._owner = np.full(len(target.grid.order), -1, np.int32)
        self._partner = np.full(self._points.shape[1], -1, np.int32)
        self._distance2 = np.empty(self._points.shape[1])
        self._unscreened = max(_UNSCREENED, _UNSCREENED_POINTS // points.shape[1])

    def rejects(self, move: NDArray[np.float64], needed: float) -> bool:
        """Return whether the sample's log chance under a move is above half of what is needed."""
        self._unscreened -= 1
        if self._unscreened >= 0:
            return False
        t2 = self._target.tolerance**2
        inside = overlay.refine(
            *(self._points, self._target.grid, t2, 1, self._owner, self._partner),
            *(self._distance2, self._visits, move.copy()),
        )
        if inside < 0:
            return True
        arrays = self._partner, self._distance2, inside
        determined = len(move) // 2
        chance = overlay.log_chance(*arrays, t2, self._target.density, determined)
        return bool(chance > needed / 2)

"""What searches by proposals from triangles share: parameters, and the test of a proposal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.pointset.triangles._sequential_test_kernel import hit_log_likelihoods

if TYPE_CHECKING:
    from fpmatch.pointset.given_set import Target

MAX_CHANCE: Final = 1e-3
"""Expected number of matches as good by chance, under which a match is accepted."""

MAX_ROUNDS: Final = 12

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
    max_overlaid: int = 20_000_000
    """Points that are overlaid to refine proposals that passed, at most."""

    def of_test(self, target: Target, number: int) -> tuple[Any, ...]:
        """Return the last arguments of a `SequentialTest` of `number` points, but for the fit."""
        reach2 = self.reach * target.tolerance**2
        gain = np.empty(_GAIN_STEPS)
        miss = hit_log_likelihoods(math.pi * reach2 * target.density, self.share, gain)
        half_of_all = 0.5 * (number - 3) * float(gain[0])
        return (
            *(reach2, gain, miss, self.reject, self.accept, min(self.accept_small, half_of_all)),
            *(self.test_length, np.zeros(number, np.int32)),
            np.empty(min(number, _MAX_GROWN), np.int32),
        )

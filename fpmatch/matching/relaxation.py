"""Relaxation of local matches: pairs of minutiae support each other, or fade.

In a local match, the neighbourhoods of two minutiae are similar. Local matches of one finger
agree with one another wherever they lie near each other, also where skin is stretched and no
transform fits the whole print; those of two fingers agree by chance alone. `_relaxation_kernel` has
the method and its source.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RelaxationParameters:
    """Set the relaxation; lengths in pixels at 500 dpi.

    Parameters
    ----------
    candidates : int
        Local matches that take part, at most; each minutia is in one of them.
    distance_px, distance_per_px : float
        How far the distances between two minutiae may differ in the two prints: the base, and the
        growth with the distance, as skin stretches.
    max_rotation_deg : float
        Largest difference of the rotations of two candidates.
    max_angle_deg : float
        Largest difference of the directions from one minutia to the other.
    rounds : int
        Rounds of relaxation.
    inertia : float
        Share of its value that a candidate keeps in a round.
    least_seed_share : float
        Share of the strongest candidate's relaxed similarity from which a candidate can be the seed
        of a hypothesis.
    least_share : float
        Share of the strongest candidate's relaxed similarity from which a candidate is a pair.
    """

    candidates: int = 32
    distance_px: float = 6.0
    distance_per_px: float = 0.08
    max_rotation_deg: float = 25.0
    max_angle_deg: float = 30.0
    rounds: int = 5
    inertia: float = 0.5
    least_seed_share: float = 0.5
    least_share: float = 0.25

    @property
    def min_rotation_cosine(self) -> float:
        """Cosine of the largest difference of rotations."""
        return math.cos(math.radians(self.max_rotation_deg))

    @property
    def min_angle_cosine(self) -> float:
        """Cosine of the largest difference of directions."""
        return math.cos(math.radians(self.max_angle_deg))

"""What matching two point sets yields, whichever matcher did it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.similarity import Similarity


@dataclass(frozen=True, slots=True, eq=False)
class PointMatch:
    """Hold the result of matching P with Q.

    Parameters
    ----------
    transform : Similarity or None
        Maps P onto Q; None where there is no match.
    pairs : ndarray of int32, shape (K, 2)
        Indices (into P, into Q), one-to-one, sorted by the first.
    matched_share : float
        K over the number of points in the smaller set; 0 where there is no match.
    rms : float
        Root mean square distance of the pairs after the transform, in the units of Q.
    local_matches : int
        How many local matches the search followed: pairs of alike rings, pairs of alike triangles
        that passed their test, or pairs of alike neighbourhoods.
    chance : float or None
        Expected number of matches as good between independent sets; None where the matcher does
        not estimate it.
    reason : str
        Where there is no match: why, in words, where the matcher can tell; else "".
    """

    transform: Similarity | None
    pairs: NDArray[np.int32]
    matched_share: float
    rms: float
    local_matches: int
    chance: float | None = None
    reason: str = ""

    @classmethod
    def none(cls, local_matches: int = 0, reason: str = "") -> PointMatch:
        """Return the result of a search that found nothing."""
        nothing = np.empty((0, 2), np.int32)
        return cls(None, nothing, 0.0, 0.0, local_matches, reason=reason)

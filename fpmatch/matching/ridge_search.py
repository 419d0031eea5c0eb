"""Ridge search: the alignment of two prints by their ridges, if minutiae leave a doubt."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RidgeSearchParameters:
    """Set the search; lengths in px at 500 dpi.

    Parameters
    ----------
    compared : int
        Pairs of minutiae under which the ridges of a small print are compared: 1 to 128.
    found : int
        Pairs by which a small print is aligned: 1 to 8.
    candidates : int
        Candidates of the relaxed local matches under which the ridges of larger prints are
        compared: 1 to 128. By the best of them these are aligned.
    candidate_flow, candidate_value : float
        Least agreement of the orientation of these candidates, see `least_flow`; and by how much,
        times the square root of the number of cells, their correlation must be above the usual.
    least_common : float
        Share of the smaller print that must lie in the larger.
    least_flow : float
        Least agreement of the orientation, -1 to 1: the mean cosine of twice the difference.
    usual_correlation : float
        Correlation of the ridges of different fingers.
    apart_px, apart_deg : float
        How far apart two transforms map the middle of the smaller print, or by how much they differ
        in rotation, to be different.
    """

    compared: int = 64
    found: int = 4
    candidates: int = 3
    candidate_flow: float = 0.9
    candidate_value: float = 3.0
    least_common: float = 0.25
    least_flow: float = 0.8
    usual_correlation: float = 0.2
    apart_px: float = 12.0
    apart_deg: float = 12.0

    @property
    def apart_cosine(self) -> float:
        """Cosine of `apart_deg`."""
        return math.cos(math.radians(self.apart_deg))

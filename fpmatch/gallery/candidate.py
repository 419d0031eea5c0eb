"""One line of the result of a search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fpmatch.matching.result import Comparison


@dataclass(frozen=True, slots=True)
class Candidate:
    """Hold one enrolled finger, or impression, that may be the probe's; rank 1 scores highest.

    `number` is that of the entry; of a finger, that of its most similar impression, to which
    `similarity`, `comparison` (if requested) and `impression_score` belong. `fmr` is the rate at
    which comparisons with another finger, of as many `impressions`, score as high, and `score` is
    ``-10·log10(fmr)``, 0 to 100; see `fpmatch.matching.finger`. `expected_false` is `fmr` times the
    number of searched fingers (or impressions): how many score as high if none is the probe's.
    """

    rank: int
    number: int
    similarity: float
    score: float
    fmr: float
    expected_false: float
    comparison: Comparison | None = None
    impressions: int = 1
    impression_score: float = 0.0

"""Decisions and rates as the drawings and reports write them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from fpmatch.matching.verification import Verification


def verdict(match: bool) -> str:
    """Return the decision on two sets of points in capitals."""
    return "MATCH" if match else "NO MATCH"


def outcome(verification: Verification) -> str:
    """Return the decision on two prints in capitals, and what is missing for one."""
    shortage = verification.shortage
    return verification.decision.upper() + ("" if shortage is None else f": {shortage.code}")


NEARLY_ALL: Final = "nearly all"
_NEARLY_ALL_FROM: Final = 0.95  # rates above round to 1 in 1


def odds(fmr: float) -> str:
    """Write a false match rate as one in so many."""
    if not 0 < fmr <= 1:
        return "unknown"
    if fmr > _NEARLY_ALL_FROM:
        return NEARLY_ALL
    n = 1 / fmr
    for size, word in ((1e9, " billion"), (1e6, " million")):
        if n >= size * 0.9995:
            return f"1 in {n / size:.2g}{word}" if n < 100 * size else f"1 in {n / size:.0f}{word}"
    if n < 10:
        return f"1 in {n:.1f}".removesuffix(".0")
    digits = max(0, math.floor(math.log10(n)) - 1)
    return f"1 in {round(n / 10**digits) * 10**digits:,}"


def score_as_high(rate: str) -> str:
    """Return the sentence about a false match rate, as `odds` writes it."""
    verb = "score" if rate.endswith(NEARLY_ALL) else "scores"
    return f"{rate} pairs of different fingers {verb} as high"

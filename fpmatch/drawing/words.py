"""The words for a decision and for a false match rate, wherever they are shown."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fpmatch.matching.result import Verification


def verdict(verification: Verification) -> str:
    """Return the decision in capitals."""
    return "MATCH" if verification.match else "NO MATCH"


def odds(fmr: float) -> str:
    """Put a false match rate as one in so many.

    Examples
    --------
    >>> odds(1e-4), odds(0.37), odds(6e-7), odds(1e-10)
    ('1 in 10,000', '1 in 2.7', '1 in 1.7 million', '1 in 10 billion')
    """
    if not 0 < fmr <= 1:
        return "unknown"
    n = 1 / fmr
    for size, word in ((1e9, " billion"), (1e6, " million")):
        if n >= size * 0.9995:
            return f"1 in {n / size:.2g}{word}" if n < 100 * size else f"1 in {n / size:.0f}{word}"
    if n < 10:
        return f"1 in {n:.1f}".removesuffix(".0")
    digits = max(0, math.floor(math.log10(n)) - 1)
    return f"1 in {round(n / 10**digits) * 10**digits:,}"

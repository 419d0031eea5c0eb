"""Decisions, rates, angles and numbers as the drawings and reports write them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fpmatch.pointset.similarity import Similarity


def verdict(match: bool) -> str:
    """Return the decision in capitals."""
    return "MATCH" if match else "NO MATCH"


def odds(fmr: float) -> str:
    """Write a false match rate as one in so many.

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


def number(value: float, digits: int = 3) -> str:
    """Write a number with a proper minus and no minus zero.

    Examples
    --------
    >>> number(-0.25, 2), number(-0.0001)
    ('−0.25', '0.000')
    """
    return f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")


def significant(value: float, digits: int = 3) -> str:
    """Write a positive number to so many digits, zeros at its end included.

    Examples
    --------
    >>> significant(0.57), significant(123.4), significant(1e9)
    ('0.570', '123', '1.00e+09')
    """
    return f"{value:#.{digits}g}".removesuffix(".")


def degrees(radians: float) -> str:
    """Write an angle in degrees, to a tenth.

    Examples
    --------
    >>> degrees(-math.pi / 3), degrees(-1e-4)
    ('−60.0°', '0.0°')
    """
    return number(math.degrees(radians), 1) + "°"


def positive_degrees(radians: float) -> str:
    """Write an angle in degrees, from 0 up to less than 360.

    Examples
    --------
    >>> positive_degrees(-math.pi / 3), positive_degrees(-1e-4)
    ('300.0°', '0.0°')
    """
    return f"{round(math.degrees(radians) % 360, 1) % 360:.1f}°"


def point_name(letter: str, place: int) -> str:
    """Return the name of a ring's point by its place, from 0: p₁ is the first of P's.

    Examples
    --------
    >>> point_name("P", 0), point_name("Q", 9)
    ('p₁', 'q₁₀')
    """
    return letter.lower() + str(place + 1).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def rotated_and_scaled(transform: Similarity) -> str:
    """Describe a transform without its shift.

    Examples
    --------
    >>> from fpmatch.pointset.similarity import Similarity
    >>> rotated_and_scaled(Similarity(scale=2.0, rotation=-0.5))
    'rotated by −28.6°, scaled by 2.00'
    """
    return f"rotated by {degrees(transform.rotation)}, scaled by {significant(transform.scale)}"

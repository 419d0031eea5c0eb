"""How the pictures write names and numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fpmatch.pointset.similarity import Similarity


def name(side: str, place: int) -> str:
    """Return the name of a ring's point by its place, from 0: p₁ is the first of P's.

    Examples
    --------
    >>> name("P", 0), name("Q", 9)
    ('p₁', 'q₁₀')
    """
    return f"{side.lower()}{subscript(place + 1)}"


def subscript(n: int) -> str:
    """Write a number as a subscript.

    Examples
    --------
    >>> "p" + subscript(12)
    'p₁₂'
    """
    return str(n).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def number(value: float, digits: int = 3) -> str:
    """Write a number with a proper minus and no minus zero.

    Examples
    --------
    >>> number(-0.25, 2), number(-0.0001)
    ('−0.25', '0.000')
    """
    return f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")


def moved_by(transform: Similarity) -> str:
    """Say what a transform does, shift aside.

    Examples
    --------
    >>> from fpmatch.pointset.similarity import Similarity
    >>> moved_by(Similarity(scale=2.0, rotation=-0.5))
    'rotated by −28.6°, scaled by 2.00'
    """
    return f"rotated by {degrees(transform.rotation_deg)}, scaled by {significant(transform.scale)}"


def significant(value: float, digits: int = 3) -> str:
    """Write a positive number to so many digits, zeros at its end included.

    Examples
    --------
    >>> significant(0.57), significant(123.4), significant(1e9)
    ('0.570', '123', '1.00e+09')
    """
    return f"{value:#.{digits}g}".removesuffix(".")


def degrees(angle: float, digits: int = 1) -> str:
    """Write an angle in degrees, with a proper minus and no minus zero.

    Examples
    --------
    >>> degrees(-12.345), degrees(-0.01)
    ('−12.3°', '0.0°')
    """
    return f"{round(angle, digits) + 0.0:.{digits}f}°".replace("-", "−")


def around(angle: float, digits: int = 1) -> str:
    """Write an angle in degrees, from 0 up to less than 360.

    Examples
    --------
    >>> around(-12.345), around(-0.01)
    ('347.7°', '0.0°')
    """
    return degrees(round(angle % 360, digits) % 360, digits)

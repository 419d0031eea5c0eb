"""What matching two point sets found, in words, for the picture and for people at a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from fpmatch.pointset.point_match import PointMatch
    from fpmatch.pointset.similarity import Similarity

Fact: TypeAlias = tuple[str, str]
"""A label and its value."""


def match_facts(match: PointMatch) -> list[Fact]:
    """Return what was found, as (label, value); nothing where there is no match.

    Parameters
    ----------
    match : PointMatch
        What a matcher found.

    Returns
    -------
    list of (str, str)
        Pairs, transform, residual, and what chance would do where the matcher estimates it.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch.pointset.match import match_points
    >>> points = np.random.default_rng(7).uniform(0, 100, (40, 2))
    >>> dict(match_facts(match_points(points, 2 * points)))["Transform"]
    'scale 2, rotation 0.000°, shift +0, +0'
    """
    if match.transform is None:
        return []
    found = [
        ("Pairs", f"{len(match.pairs):,}, {match.matched_share:.1%} of the smaller set"),
        ("Transform", _in_words(match.transform)),
        ("Residual", f"{match.rms:.4g} rms"),
    ]
    if match.chance is None:
        return found
    count = f"{match.chance:.2g}" if match.chance > 0 else "less than 1e-300"
    return [*found, ("Chance", f"{count} matches as good expected between independent sets")]


def _in_words(transform: Similarity) -> str:
    """Return how P moves onto Q, its rotation in words that hold wherever y points."""
    t = transform
    degrees = round(t.rotation_deg, 3)
    sense = "" if degrees == 0 else " from x to y" if degrees > 0 else " from y to x"
    return (
        f"scale {t.scale:.6g}, rotation {abs(degrees):.3f}°{sense}, "
        f"shift {_signed(t.tx)}, {_signed(t.ty)}"
    )


def _signed(value: float) -> str:
    """Return a shift with its sign; what only rounding left over is 0."""
    return f"{round(value, 12) + 0.0:+.6g}"

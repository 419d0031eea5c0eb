"""The result of matching two point sets in words, for the plot and for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fpmatch.pointset.point_match import PointMatch


def match_facts(match: PointMatch) -> list[tuple[str, str]]:
    """Return the result as (label, value): pairs, transform, residual, and expectation by chance.

    There are none where there is no match, and no chance where the matcher does not estimate it.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch.pointset.match import match_points
    >>> points = np.random.default_rng(7).uniform(0, 100, (40, 2))
    >>> dict(match_facts(match_points(points, 2 * points)))["Transform"]
    'scale 2, rotation 0.000°, shift +0, +0'
    """
    t = match.transform
    if t is None:
        return []
    degrees = round(t.rotation_deg, 3)  # the sense holds wherever y points
    sense = "" if degrees == 0 else " from x to y" if degrees > 0 else " from y to x"
    shift = f"{_signed(t.tx)}, {_signed(t.ty)}"
    facts = [
        ("Pairs", f"{len(match.pairs):,}, {match.matched_share:.1%} of the smaller set"),
        ("Transform", f"scale {t.scale:.6g}, rotation {abs(degrees):.3f}°{sense}, shift {shift}"),
        ("Residual", f"{match.rms:.4g} rms"),
    ]
    if match.chance is not None:
        count = f"{match.chance:.2g}" if match.chance > 0 else "less than 1e-300"
        facts.append(("Chance", f"{count} matches as good expected between independent sets"))
    return facts


def _signed(value: float) -> str:
    """Return a shift with its sign; errors of rounding are 0."""
    return f"{round(value, 12) + 0.0:+.6g}"

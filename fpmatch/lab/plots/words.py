"""Matches of points, angles and numbers as the plots and figures write them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from fpmatch.pointset.geometry.affine_transform import AffineTransform
    from fpmatch.pointset.geometry.point_match import PointMatch


def number(value: float, digits: int = 3) -> str:
    """Write a number with a proper minus and no minus zero."""
    return f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")


def significant(value: float, digits: int = 3) -> str:
    """Write a positive number to so many digits, zeros at its end included."""
    return f"{value:#.{digits}g}".removesuffix(".")


def degrees(radians: float) -> str:
    """Write an angle in degrees, to a tenth."""
    return number(math.degrees(radians), 1) + "°"


def positive_degrees(radians: float) -> str:
    """Write an angle in degrees, from 0 up to less than 360."""
    return f"{round(math.degrees(radians) % 360, 1) % 360:.1f}°"


def match_facts(match: PointMatch) -> list[tuple[str, str]]:
    """Return a match, if it is one, as (label, value): pairs, transform, residual, chance."""
    t = match.transform
    if t is None:
        return []
    stretch, movement = _transform_in_words(t)
    facts = [
        ("Pairs", f"{len(match.pairs):,}, {match.matched_share:.1%} of the smaller set"),
        *([("Stretch", stretch)] if stretch else []),
        ("Transform", movement),
        ("Residual", f"{match.rms:.4g} rms"),
    ]
    if match.chance is not None:
        count = f"{match.chance:.2g}" if match.chance > 0 else "less than 1e-300"
        facts.append(("Chance", f"{count} matches as good expected between independent sets"))
    return facts


def _transform_in_words(t: Similarity | AffineTransform) -> tuple[str, str]:
    """Describe what a transform stretches, if anything, and the rest of it, in their order."""
    turn = round(t.rotation_deg, 3)  # the sense holds wherever y points
    sense = "" if turn == 0 else " from x to y" if turn > 0 else " from y to x"
    x, y = (round(value, 12) + 0.0 for value in (t.tx, t.ty))  # errors of rounding are 0
    mirror = "mirrored (y to -y), " if t.mirrored else ""
    movement = f"rotation {abs(turn):.3f}°{sense}, shift {x:+.6g}, {y:+.6g}"
    if isinstance(t, Similarity) or t.is_similarity:
        return "", f"{mirror}scale {t.scale:.6g}, {movement}"
    scales = f"scale {t.scale_x:.6g} along x and {t.scale_y:.6g} along y"
    return f"{mirror}{scales}, shear {t.shear:.6g}", movement

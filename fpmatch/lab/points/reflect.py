"""The better of two matches: of a point set, and of its mirror image."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.pointset.geometry.affine_transform import AffineTransform
from fpmatch.pointset.geometry.points import as_points

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.geometry.point_match import PointMatch

TRIALS: Final = 2
"""A search of the set and one of its mirror image: chance has twice the opportunity."""

_MIRROR: Final = AffineTransform.of_parts(mirrored=True)
_FLIP: Final = np.array([1.0, -1.0])


def match_either_way(
    search: Callable[[NDArray[np.float64]], PointMatch], p: ArrayLike
) -> PointMatch:
    """Return the better of the matches that `search` finds for P and for its mirror image.

    Better is what is less expected by chance; where chance is not estimated, or both are below
    what a float holds, more pairs, and then the smaller residual. Of equals the map that is not
    mirrored is taken. The chance of the result is that of two searches.
    """
    plain, flipped = search(as_points(p, "p")), search(mirror_image(p))
    best = flipped if _order(flipped) < _order(plain) else plain
    if best is flipped and flipped.transform is not None:
        transform = AffineTransform.of_matrix(flipped.transform.matrix).after(_MIRROR)
        best = replace(flipped, transform=transform)
    local_matches = plain.local_matches + flipped.local_matches
    chance = None if best.chance is None else TRIALS * best.chance
    reason = best.reason
    if best.transform is None and flipped.reason != plain.reason:
        reason = f"{plain.reason}; of the mirror image, {flipped.reason}"
    return replace(best, chance=chance, local_matches=local_matches, reason=reason)


def mirror_image(p: ArrayLike) -> NDArray[np.float64]:
    """Return points (N, 2) with y turned to -y."""
    return np.asarray(as_points(p, "p") * _FLIP)


def _order(match: PointMatch) -> tuple[bool, float, int, float]:
    """Return what orders matches from the best to none."""
    chance = 0.0 if match.chance is None else match.chance
    return match.transform is None, chance, -len(match.pairs), match.rms

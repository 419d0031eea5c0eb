"""Match two point sets by any matcher of this folder."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.errors import PointSetError, unknown_name
from fpmatch.lab.points.triangles.given_set import GivenSet, check_tolerance
from fpmatch.lab.points.triangles.matcher import (
    MAX_CHANCE,
    MIN_POINTS_TO_MATCH,
    match_by_triangles,
)
from fpmatch.lab.points.van_wamelen.matcher import match_van_wamelen
from fpmatch.pointset.geometry.point_match import PointMatch, check_rho, too_few
from fpmatch.pointset.geometry.points import as_points
from fpmatch.pointset.paper.matcher import (
    DEFAULT_RHO,
    UnitCircleParameters,
    decided,
    match_by_unit_circle,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

POINT_MATCHERS: Final = ("triangles", "paper", "van-wamelen")

DEFAULT_LAMBDA: Final = 0.61
"""λ of the paper's experiments with the least ρ, in mean nearest-neighbour distances of Q."""

_TRIALS: Final = 2  # searches of a set and its mirror image: chance has twice the opportunity


def match_points(
    p: ArrayLike,
    q: ArrayLike,
    *,
    tolerance: float | None = None,
    matcher: str = "triangles",
    rho: float | None = None,
    reflect: bool = False,
) -> PointMatch:
    """Find the transform that maps points of P onto points of Q, if there is one.

    Parameters
    ----------
    p, q : array_like of float, shape (N, 2) and (M, 2)
        The point sets; a part of one has partners in the other.
    tolerance : float, optional
        Largest distance of a pair after the transform, in the units of Q; by default a share of
        the spacing of Q that suits the matcher.
    matcher : {"triangles", "paper", "van-wamelen"}
        "triangles" is fast, robust to missing points, jitter and outliers, and finds no match where
        nothing is better than chance; "paper" is the paper's method; "van-wamelen" is the paper's
        baseline. Their modules have functions with more parameters.
    rho : float, optional
        ρ, for "paper" (0.6 by default; more than this share of the smaller set must be paired) and
        "van-wamelen" (this share of P).
    reflect : bool
        Whether to seek mirrored maps too. Both the set and its mirror image are tried, and what
        is less expected by chance is the result (more pairs, for "paper" and "van-wamelen").

    Returns
    -------
    PointMatch
        Transform, pairs, matched share, rms distance, and the expected number of matches as good
        by chance; no transform where there is no match, but a reason, which says so where the
        search ended at its limit or where several maps, `equal_maps`, fit equally well.

    Raises
    ------
    PointSetError
        If a set is malformed, has fewer than three points or all of them on one line, the
        tolerance is not positive, `rho` is outside 0..1, or the matcher is unknown or has no `rho`.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import match_points
    >>> from fpmatch.pointset.geometry.similarity import Similarity
    >>> points = np.random.default_rng(7).uniform(0, 100, (40, 2))
    >>> moved = Similarity(scale=2.0, rotation=0.5, tx=10.0, ty=-4.0).apply(points)
    >>> match = match_points(points[5:], moved)
    >>> match.matched_share, round(match.transform.scale, 6), match.chance < 1e-6
    (1.0, 2.0, True)
    >>> match_points(points, np.random.default_rng(8).uniform(0, 100, (40, 2))).transform is None
    True
    >>> mirrored = match_points(points * [-1, 1], moved, reflect=True)
    >>> mirrored.transform.mirrored, round(mirrored.transform.scale, 6)
    (True, 2.0)
    """
    if matcher not in POINT_MATCHERS:
        raise PointSetError(unknown_name("matcher", matcher, POINT_MATCHERS))
    if rho is not None and matcher == "triangles":
        raise PointSetError("rho is a parameter of the matchers paper and van-wamelen")
    check_tolerance(tolerance)
    share = DEFAULT_RHO if rho is None else rho
    check_rho(share)
    chance = MAX_CHANCE / _TRIALS if reflect else MAX_CHANCE
    if matcher != "triangles" and min(len(GivenSet("p", p)), len(GivenSet("q", q))) < 4:
        return PointMatch.none(reason=too_few(MIN_POINTS_TO_MATCH))

    def search(of_p: NDArray[np.float64]) -> PointMatch:
        if matcher == "paper":
            given = UnitCircleParameters(tolerance=tolerance)
            return decided(match_by_unit_circle(of_p, q, given), share)
        if matcher == "van-wamelen":
            return match_van_wamelen(
                of_p, q, rho=share, lambda_=DEFAULT_LAMBDA, tolerance=tolerance
            )
        return match_by_triangles(of_p, q, tolerance=tolerance, max_chance=chance)

    points = as_points(p, "p")
    match = search(points)
    if not reflect:
        return match
    flipped = search(points * (1.0, -1.0))
    if flipped.transform is not None:
        flipped = replace(flipped, transform=replace(flipped.transform, mirrored=True))
    # where chance is not estimated, or below what a float holds, more pairs are better
    best = min(
        (match, flipped),
        key=lambda one: (one.transform is None, one.chance or 0.0, -len(one.pairs), one.rms),
    )
    return best if best.chance is None else replace(best, chance=_TRIALS * best.chance)

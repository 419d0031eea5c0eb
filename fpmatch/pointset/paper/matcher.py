"""Point pattern matching by unit-circle parametrization: the paper's section 3.3 and Fig. 7.

1. *Precomputation*, once for each set (`prepare_points`): triangulate it, and map every closed
   one-ring to the unit circle.
2. *Local matching* (`similar_rings`, `fit_rings`): two rings are similar where they have as many
   points and the areas of their inscribed polygons differ by no more than a tolerance. A pair of
   similar rings gives a transform, its rotation from the rotation between the two circles.
3. *Global matching* (`best_overlay`): overlay the sets by each transform and count the points that
   match. The sets match where more than a share ρ of the points do.

What the paper leaves open, and how it is settled here:

- the area tolerance, which the paper calls pre-defined without a value, is
  `DEFAULT_AREA_TOLERANCE` of an area that is at most π;
- the share ρ is of the smaller set: in all the paper's experiments that is P, of which a share ρ
  has partners, and of the larger set no more points could ever be matched;
- the rotation is that of the cyclic shift under which boundary and centre's image of the two
  circles correlate most (the paper's "angle differences between c_p and c_q", made stable where a
  centre's image is near the middle); the transform is the least-squares fit of eq. (1) to the two
  rings;
- the tolerance of eq. (2), t = λ·r/(2√n), is taken by density: the mean nearest-neighbour
  distance of n random points over the area of the target's convex hull, times λ;
- the set with fewer points is moved onto the other, so that the result does not depend on which of
  the two comes first; of transforms with equal counts the first found is kept.

Where this departs from Fig. 7:

- pairs of rings of equal degree and similar area are looked up in a sorted table before the loop,
  and not tested pair by pair within it; the pairs are the same;
- points are matched one to one, where the paper counts points that have any partner;
- the best transform is refitted once to the points it matched, and the refitted one is kept unless
  it matches fewer;
- the search goes on to the transform that matches the most points unless a matching factor ends it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.parameters import parameter
from fpmatch.errors import PointSetError, number_text
from fpmatch.pointset.geometry.frames import between_sets
from fpmatch.pointset.geometry.pairing import greedy_pairs, index_pairs
from fpmatch.pointset.geometry.point_match import PointMatch, check_rho, fewest_above, rms_distance
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper import _one_ring_kernel as kernel
from fpmatch.pointset.paper.one_rings import PreparedPoints, prepare_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.paper.one_rings import OneRings

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

DEFAULT_AREA_TOLERANCE: Final = 0.1
"""Largest difference of the areas of similar rings, the circle's own area being π."""

DEFAULT_RHO: Final = 0.6
"""ρ, the share of the smaller set that must be exceeded: the least of the paper's experiments."""


@dataclass(frozen=True, slots=True)
class UnitCircleParameters:
    """Rings on the unit circle, and the points that match.

    `tolerance` is the matching distance itself, in the units of the larger set; it replaces
    `precision`. Values outside their range raise a `PointSetError`.
    """

    area_tolerance: float = parameter(
        DEFAULT_AREA_TOLERANCE,
        "largest difference in area of corresponding rings on the unit circle, whose own area is π",
        1e-9,
        10,
    )
    precision: float = parameter(
        0.428,
        "λ of eq. (2): the matching distance in mean nearest-neighbour distances of the target",
        0,
        10,
    )
    tolerance: float | None = None
    matching_factor: float = parameter(
        1.0,
        "the search ends with the first transform that pairs more than this share of the smaller "
        "set",
        0,
        1,
    )
    max_scale: float = parameter(
        math.inf, "largest factor by which a transform changes the scale, either way", 1, math.inf
    )

    def __post_init__(self) -> None:
        if not self.area_tolerance > 0:
            raise PointSetError(
                f"area tolerance must be positive, not {number_text(self.area_tolerance)}"
            )
        if not self.precision >= 0 or not self.max_scale >= 1:
            raise PointSetError("precision must be 0 or more, max scale 1")
        if self.tolerance is not None and not 0 <= self.tolerance < math.inf:
            raise PointSetError(f"tolerance must be 0 or more, not {number_text(self.tolerance)}")
        check_rho(self.matching_factor)


def match_by_unit_circle(
    p: ArrayLike, q: ArrayLike, parameters: UnitCircleParameters | None = None
) -> PointMatch:
    """Match two point sets, (N, 2) and (M, 2), by their one-rings on the unit circle.

    Exchanging the sets gives the same pairs and the inverse transform. Raises PointSetError if a
    set is malformed, or its coordinates are beyond ±2**300, or its extent is below 2**-300.
    """
    return match_prepared(prepare_points(p), prepare_points(q), parameters)


def match_prepared(
    p: PreparedPoints, q: PreparedPoints, parameters: UnitCircleParameters | None = None
) -> PointMatch:
    """Match two prepared sets; see `match_by_unit_circle`."""
    given = parameters or UnitCircleParameters()
    if (len(p), p.points.tobytes()) > (len(q), q.points.tobytes()):
        return match_prepared(q, p, given).inverse()
    ring_pairs = similar_rings(p.rings, q.rings, given.area_tolerance)
    moves = _without_collapse(fit_rings(p, q, ring_pairs), p, q, given.max_scale)
    tolerance = given.precision * q.spacing  # eq. (2), in the unit frame of q
    if given.tolerance is not None:
        tolerance = math.ldexp(given.tolerance, -q.frame.exponent)
    best = _match_globally(p, q, moves, tolerance, given.matching_factor)
    if best is None:
        return PointMatch.none(len(ring_pairs))
    move, pairs = best
    rms = rms_distance(move.apply(p.unit.T[pairs[:, 0]]), q.unit.T[pairs[:, 1]])
    return PointMatch(
        transform=between_sets(move, p.frame, q.frame),
        pairs=pairs,
        matched_share=len(pairs) / len(p),
        rms=math.ldexp(rms, q.frame.exponent),
        local_matches=len(ring_pairs),
    )


def decided(match: PointMatch, rho: float) -> PointMatch:
    """Return a match of more than a share ρ of the smaller set, else no match and the reason."""
    if match.matched_share > rho or match.reason:
        return match
    if match.transform is not None:
        reason = (
            f"the best transform pairs {match.matched_share:.1%} of the smaller set; a match needs "
            f"more than {rho:.4g}"
        )
    elif match.local_matches:
        reason = "no transform maps points of one set onto points of the other"
    else:
        reason = "no one-ring of one set is similar to one of the other"
    return PointMatch.none(match.local_matches, reason)


def similar_rings(p: OneRings, q: OneRings, area_tolerance: float) -> Ints:
    """Return the pairs (K, 2) of rings of equal degree with areas within a tolerance."""
    degrees_apart = 8.0  # more than any two areas on the unit circle differ
    reach = min(area_tolerance, degrees_apart / 2)
    key_p, key_q = (rings.degree * degrees_apart + rings.area for rings in (p, q))
    first = key_q.searchsorted(key_p - reach, "left")
    end = key_q.searchsorted(key_p + reach, "right")
    return np.column_stack(index_pairs(first, end)).astype(np.int32)


def fit_rings(p: PreparedPoints, q: PreparedPoints, ring_pairs: Ints) -> Floats:
    """Return the move (s·cos θ, s·sin θ, tx, ty) of each pair of rings (K, 4), in unit frames.

    It is the fit of eq. (1) to both rings with their centres, the second ring shifted so that the
    circles correlate most after a rotation; the centre's image counts as much as the whole
    boundary. It is all 0 where there is no such fit.
    """
    moves = np.empty((len(ring_pairs), 4))
    a, b = p.rings, q.rings
    kernel.fit_ring_pairs(
        ring_pairs,
        *(p.unit, a.centre, a.start, a.vertex, a.circle, a.image),
        *(q.unit, b.centre, b.start, b.vertex, b.circle, b.image),
        moves,
    )
    return moves


def best_overlay(
    p: PreparedPoints, q: PreparedPoints, moves: Floats, tolerance: float, enough: int
) -> tuple[int, int] | None:
    """Return which of `moves` (K, 4) overlays the most points, and how many; None for no points.

    The search ends with the first that overlays `enough` points. The matching distance is in the
    unit frame of `q`.
    """
    best = np.empty(2, np.int32)
    kernel.best_overlay(
        moves, p.unit, q.grid, tolerance, enough, np.full(len(q), -1, np.int32), best
    )
    return (int(best[0]), int(best[1])) if best[0] >= 0 else None


def _match_globally(
    p: PreparedPoints, q: PreparedPoints, moves: Floats, tolerance: float, rho: float
) -> tuple[Similarity, Ints] | None:
    """Return the first transform, refitted, that pairs more than a share ρ, or the best; its pairs.

    A transform may overlay enough points and yet pair fewer one to one; the search then goes on.
    """
    best: tuple[Similarity, Ints] | None = None
    enough = min(fewest_above(rho, len(p)), len(p))
    begin = 0
    while overlay := best_overlay(p, q, moves[begin:], tolerance, enough):
        index, count = overlay
        move, pairs = _refit(p, q, Similarity.of_move(moves[begin + index]), tolerance)
        if best is None or len(pairs) > len(best[1]):
            best = move, pairs
        if count < enough or len(pairs) >= enough:
            break
        begin += index + 1
    return best


def _refit(
    p: PreparedPoints, q: PreparedPoints, move: Similarity, tolerance: float
) -> tuple[Similarity, Ints]:
    """Refit a transform to the points it matches, unless that loses pairs."""
    xy_p, xy_q = p.unit.T, q.unit.T
    pairs = greedy_pairs(move.apply(xy_p), xy_q, tolerance)
    if len(pairs) < 2:
        return move, pairs
    refitted = Similarity.fit(xy_p[pairs[:, 0]], xy_q[pairs[:, 1]])
    again = greedy_pairs(refitted.apply(xy_p), xy_q, tolerance)
    return (refitted, again) if len(again) >= len(pairs) else (move, pairs)


def _without_collapse(
    moves: Floats, p: PreparedPoints, q: PreparedPoints, max_scale: float
) -> Floats:
    """Leave out transforms that map all points to one or change their scale too much."""
    scale = np.hypot(moves[:, 0], moves[:, 1])
    moves, scale = moves[scale > 0], scale[scale > 0]
    doublings = np.abs(np.log2(scale) + (q.frame.exponent - p.frame.exponent))
    return np.asarray(moves[doublings <= math.log2(max_scale)])

"""Which one-ring the pictures show: a closed one that comes again in the other set."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.paper_figures.ring import Ring, RingPair, as_complex, best_turn
from fpmatch.errors import PointSetError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.pair import PointPair
    from fpmatch.pointset.unit_circle.parametrize import UnitCircle

FEWEST, MOST = 5, 7
"""Points of a ring that is easy to read."""

WELL_OFF: Final = 0.5
"""Distance of a centre's image from the middle of the circle that is easy to see."""

WELL_APART: Final = 0.4
"""Distance of the nearest neighbour, in the mean distance of all, that is easy to see."""


def choose_ring_pair(pair: PointPair, index: int | None = None) -> RingPair:
    """Return the ring that the pictures show, with its partner.

    Parameters
    ----------
    pair : PointPair
        The sets.
    index : int, optional
        Index in P of the ring's centre; by default that of the ring of 5 to 7 points that is
        easiest to read (of other sizes where there is none).

    Returns
    -------
    RingPair
        The two rings.

    Raises
    ------
    PointSetError
        If there is no such ring, it is not closed, or it has no partner in Q.
    """
    if index is not None:
        found = _ring_pair(pair, index)
        if isinstance(found, str):
            raise PointSetError(f"{pair.p.source}: point {index}: {found}")
        return found
    closed = (_ring_pair(pair, int(i)) for i in pair.p.mesh.interior.nonzero()[0])
    rings = [ring for ring in closed if isinstance(ring, RingPair)]
    if not rings:
        raise PointSetError(
            f"{pair.p.source}: none of its closed one-rings comes again in {pair.q.source}"
        )
    return max(rings, key=_clarity)


def _ring_pair(pair: PointPair, index: int) -> RingPair | str:
    """Return the ring of point `index` of P and its partner, or say why there is none."""
    count = len(pair.p.mesh)
    if not 0 <= index < count:
        return f"there is none, they go from 0 to {count - 1}"
    if not pair.p.mesh.interior[index]:
        return "its one-ring is not closed, as it lies on the outer boundary or on another point"
    partner = dict(pair.pairs.tolist())
    if index not in partner:
        return "it has no partner in the other set"
    other = partner[index]
    expected = [partner.get(k) for k in pair.p.mesh.one_ring(index).tolist()]
    theirs = pair.q.mesh.one_ring(other).tolist() if pair.q.mesh.interior[other] else []
    for true_shift in range(len(theirs)):
        if theirs[true_shift:] + theirs[:true_shift] == expected:
            try:
                p, q = Ring.of(pair.p, index), Ring.of(pair.q, other)
            except PointSetError as error:  # rounding has put a point outside its ring
                return f"it has no unit circle ({error})"
            shift, turn = best_turn(p.circle, q.circle)
            return RingPair(p, q, shift, true_shift, turn)
    return f"the one-ring of its partner, point {other} of the other set, is made of other points"


def _clarity(rings: RingPair) -> tuple[bool, bool, bool, float]:
    """Rank rings: right shift, few points, inside the set; uncrowded, images off the middle."""
    p, q = rings.p, rings.q
    inside = all(ring.side.mesh.interior[ring.vertex].all() for ring in (p, q))
    narrowest = min(min(ring.arcs.min(), _spoke_gaps(ring.circle).min()) for ring in (p, q))
    off_middle = min(math.hypot(*ring.circle.image) for ring in (p, q))
    apart = min(_nearest(ring) for ring in (p, q))
    return (
        rings.shift == rings.true_shift,
        FEWEST <= len(p) <= MOST,
        inside,
        float(narrowest) * min(off_middle, WELL_OFF) * min(apart, WELL_APART),
    )


def _nearest(ring: Ring) -> float:
    """Return the distance from the centre to its nearest neighbour, in the mean distance."""
    spokes = np.hypot(*(ring.points - ring.middle).T)
    return float(spokes.min() / spokes.mean())


def _spoke_gaps(circle: UnitCircle) -> NDArray[np.float64]:
    """Return the angles between the spokes at a centre's image, in radians, shape (d,)."""
    spokes = as_complex(circle.boundary - circle.image)
    return np.asarray(np.abs(np.angle(np.roll(spokes, -1) * spokes.conj())))

"""A one-ring mapped to the unit circle: the paper's section 3.2, for one ring at a time.

Let p_1 … p_d be the ring of a centre p, in order, and b_k = |p_{k+1} - p_k| its sides.

- *Boundary*, eq. (3): u_k = (cos A_k, sin A_k), where A_1 = 0 and A_{k+1} = A_k + 2π·b_k / Σ b.
- *Weights*, eq. (4), Floater's shape-preserving ones: for every l, the line from p_l through p
  leaves the ring by the side from p_r to p_{r+1}; p = δ1·p_l + δ2·p_r + δ3·p_{r+1} by its
  barycentric coordinates there, which give μ_{l,l}, μ_{r,l}, μ_{r+1,l}; λ_k is the mean of
  μ_{k,l} over l. They are positive, sum to 1, and Σ λ_k p_k = p.
- *Image* of the centre: c = Σ λ_k u_k, inside the circle.
- *Area* of the polygon u_1 … u_d: ½ Σ sin(A_{k+1} - A_k), invariant under
  rotation, scaling, shift and reflection of the ring.

Sources: Choi, Lee and Lee, section 3.2; Floater, "Parametrization and smooth approximation of
surface triangulations", CAGD 14 (1997).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.points import as_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True, eq=False)
class UnitCircle:
    """A one-ring of d points on the unit circle."""

    angles: NDArray[np.float64]  # (d,): of the ring's points on the circle, in radians, from 0
    weights: NDArray[np.float64]  # (d,): shape-preserving weights of the centre in its ring
    image: NDArray[np.float64]  # (2,): the image of the centre
    area: float  # of the inscribed polygon

    @property
    def boundary(self) -> NDArray[np.float64]:
        """The ring's points on the circle, shape (d, 2)."""
        return np.column_stack([np.cos(self.angles), np.sin(self.angles)])


def parametrize(ring: ArrayLike, centre: ArrayLike) -> UnitCircle:
    """Map a ring (d, 2) and its centre (2,) to the unit circle.

    The ring is in order, either way round; seen from the centre, each point lies less than half a
    turn from the next, as in a triangulation. The first has angle 0, the others follow counter-
    clockwise. A ring that does not go once round its centre is refused with a `PointSetError`.
    """
    angles = boundary_angles(ring)
    weights = shape_preserving_weights(ring, centre)
    image = weights @ np.column_stack([np.cos(angles), np.sin(angles)])
    area = float(np.sin(np.roll(angles, -1) - angles).sum() / 2)
    return UnitCircle(angles, weights, image, area)


def shape_preserving_weights(ring: ArrayLike, centre: ArrayLike) -> NDArray[np.float64]:
    """Return Floater's weights (d,) of a centre in its ring (eq. 4); see `parametrize`."""
    away = _offsets_from(ring, centre)
    if (away[0].conjugate() * away[1]).imag < 0:  # the ring runs clockwise: mirror it
        away = away.conjugate()
    return ring_weights(away)


def ring_weights(away: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the weights (..., d) of the origin in rings (..., d) of x + iy, counter-clockwise.

    They are NaN where a ring does not go round the origin. Points that repeat the one before share
    its weight.
    """
    cross = away.real[..., :, None] * away.imag[..., None, :]
    cross = cross - cross.swapaxes(-1, -2)
    right = cross < 0
    leaves = ~right & np.concatenate([right[..., 1:], right[..., :1]], axis=-1)
    r = leaves.argmax(axis=-1)
    s = (r + 1) % away.shape[-1]
    *rings, line = np.indices(r.shape, sparse=True)
    share = np.zeros(cross.shape)
    share[*rings, line, line] = own = cross[*rings, r, s]
    share[*rings, line, r] += cross[*rings, s, line]
    share[*rings, line, s] += cross[*rings, line, r]
    whole = share.sum(axis=-1, keepdims=True)
    around = (leaves.any(axis=-1) & (own > 0) & (whole[..., 0] > 0)).all(axis=-1)
    whole[~around] = np.nan
    new = away != np.concatenate([away[..., -1:], away[..., :-1]], axis=-1)
    total = (share / whole * new[..., None]).sum(axis=-2)
    return np.asarray(total / new.sum(axis=-1, keepdims=True))


def boundary_angles(ring: ArrayLike) -> NDArray[np.float64]:
    """Return the angles (d,) of a ring on the unit circle, eq. (3); raise PointSetError."""
    points = as_points(ring, "ring")
    if (points == points[:1]).all():
        raise PointSetError("ring: its points must not all coincide")
    return ring_angles(points.view(np.complex128).ravel())


def ring_angles(ring: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the angles (..., d) of the points x + iy of rings on their unit circles."""
    side = abs(np.concatenate([ring[..., 1:], ring[..., :1]], axis=-1) - ring)
    along = side.cumsum(axis=-1)
    return np.asarray(2 * np.pi * (along - side) / along[..., -1:])


def _offsets_from(ring: ArrayLike, centre: ArrayLike) -> NDArray[np.complex128]:
    """Return the ring's points minus the centre, as x + iy; refuse a ring not once round it."""
    points = as_points(ring, "ring")
    middle = as_points(np.asarray(centre)[None], "centre")
    away = np.asarray((points - middle).view(np.complex128).ravel())
    if len(away) < 3 or not away.all():
        raise PointSetError("ring: expected at least 3 points, none of them the centre itself")
    step = np.roll(away, -1) * away.conjugate()
    one_way = (step.imag > 0).all() or (step.imag < 0).all()
    if not one_way or abs(np.angle(step).sum()) > 3 * np.pi:  # 4π is twice round
        raise PointSetError("ring: its points must go once round the centre, in order")
    return away

"""One-rings on the unit circle, and pairs of them that correspond: what the pictures explain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.unit_circle.parametrize import UnitCircle, parametrize

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.pair import PointSide

IN_THE_MIDDLE: Final = 1e-9
"""Distance from the middle of the circle below which a centre's image has no direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """Hold a closed one-ring of d points, and its unit circle.

    Parameters
    ----------
    side : PointSide
        The set it belongs to.
    centre : int
        Index of its centre.
    vertex : ndarray of int32, shape (d,)
        Indices of its points, counter-clockwise.
    circle : UnitCircle
        Where they come to stand on the circle.
    """

    side: PointSide
    centre: int
    vertex: NDArray[np.int32]
    circle: UnitCircle

    @classmethod
    def of(cls, side: PointSide, centre: int) -> Ring:
        """Map the one-ring of point `centre` to the unit circle; it must be closed."""
        vertex = side.mesh.one_ring(centre)
        points = side.mesh.points
        return cls(side, centre, vertex, parametrize(points[vertex], points[centre]))

    def __len__(self) -> int:
        return len(self.vertex)

    @property
    def points(self) -> NDArray[np.float64]:
        """The ring's points in the unit frame of their set, shape (d, 2)."""
        return np.asarray(self.side.mesh.points[self.vertex])

    @property
    def middle(self) -> NDArray[np.float64]:
        """The centre in the unit frame of its set, shape (2,)."""
        return np.asarray(self.side.mesh.points[self.centre])

    @property
    def sides(self) -> NDArray[np.float64]:
        """Lengths b_k of the sides, each after its point, in the unit frame, shape (d,)."""
        return np.asarray(np.hypot(*(np.roll(self.points, -1, axis=0) - self.points).T))

    @property
    def arcs(self) -> NDArray[np.float64]:
        """Arcs dA_k that the sides take on the circle, in radians, shape (d,)."""
        return np.diff(self.circle.angles, append=2 * math.pi)

    @property
    def sectors(self) -> NDArray[np.float64]:
        """Areas of the sectors of the inscribed polygon seen from the middle, shape (d,)."""
        return np.asarray(np.sin(self.arcs) / 2)

    @property
    def standing(self) -> float:
        """Angle in radians by which the circle is turned to stand as its ring does.

        It brings the boundary points nearest, by least squares, to where they lie from the centre.
        """
        away = as_complex(self.points - self.middle)
        return float(np.angle((_boundary(self.circle).conj() * away).sum()))


@dataclass(frozen=True, slots=True, eq=False)
class RingPair:
    """Hold the rings of two partners.

    Parameters
    ----------
    p, q : Ring
        The rings; as many points each.
    shift : int
        The cyclic shift by which the circles lie best on one another: point k of P's ring is taken
        for point k + shift of Q's.
    true_shift : int
        The shift that the partners of the points say.
    turn : float
        Angle in radians that turns P's circle onto Q's under `shift`.
    """

    p: Ring
    q: Ring
    shift: int
    true_shift: int
    turn: float

    @property
    def partner(self) -> NDArray[np.intp]:
        """Place in Q's ring of each point of P's, shape (d,)."""
        return (np.arange(len(self.p)) + self.shift) % len(self.p)

    @property
    def move(self) -> Similarity:
        """The least-squares fit of ring and centre onto ring and centre, in the unit frames."""
        return Similarity.fit(
            np.vstack([self.p.points, self.p.middle]),
            np.vstack([self.q.points[self.partner], self.q.middle]),
        )

    @property
    def transform(self) -> Similarity:
        """The same in the units of the points as given."""
        enter, leave = self.p.side.prepared.enter_frame, self.q.side.prepared.leave_frame
        return leave.after(self.move).after(enter)

    @property
    def circle_rotation(self) -> float:
        """Rotation in radians between the circles where each stands as its ring does."""
        return math.remainder(self.turn + self.q.standing - self.p.standing, 2 * math.pi)

    @property
    def image_rotation(self) -> float | None:
        """Angle in radians from c_p to c_q where each circle stands as its ring does.

        None where an image lies in the middle of its circle, as a regular polygon's does.
        """
        c_p, c_q = as_complex(self.p.circle.image), as_complex(self.q.circle.image)
        if min(abs(c_p), abs(c_q)) < IN_THE_MIDDLE:
            return None
        between = float(np.angle(c_p.conjugate() * c_q))
        return math.remainder(between + self.q.standing - self.p.standing, 2 * math.pi)


def best_turn(a: UnitCircle, b: UnitCircle) -> tuple[int, float]:
    """Return the cyclic shift and the turn in radians that lay one circle best on another.

    As the paper's matcher does it: boundary points and centres' images correlate most, the image
    counting as much as the whole boundary.

    Parameters
    ----------
    a, b : UnitCircle
        Two circles of as many points.

    Returns
    -------
    tuple of int and float
        Point k of `a` lies on point k + shift of `b` once `a` is turned.

    Examples
    --------
    >>> from fpmatch.pointset.unit_circle.parametrize import parametrize
    >>> ring = np.array([[0, 0], [4, 0], [4, 4], [0, 5]])
    >>> best_turn(parametrize(ring, [1, 1]), parametrize(np.roll(ring, 1, axis=0), [1, 1]))[0]
    1
    """
    d = len(a.angles)
    images = d * complex(as_complex(a.image).conjugate() * as_complex(b.image))
    from_a, onto_b = _boundary(a).conj(), _boundary(b)
    agreement = np.array([images + from_a @ np.roll(onto_b, -shift) for shift in range(d)])
    shift = int(np.abs(agreement).argmax())
    return shift, float(np.angle(agreement[shift]))


def as_complex(xy: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return points (..., 2) as x + iy, shape (...)."""
    return np.asarray(xy[..., 0] + 1j * xy[..., 1])


def _boundary(circle: UnitCircle) -> NDArray[np.complex128]:
    return np.asarray(np.exp(1j * circle.angles))

"""One-rings on the unit circle, and the pair of corresponding ones that the figures explain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.lab.plots.words import point_name
from fpmatch.pointset.geometry.frames import between_sets
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.parametrize import UnitCircle, parametrize

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.paper_figures.pair import PointPair, PointSide

    Floats = NDArray[np.float64]

IN_THE_MIDDLE: Final = 1e-9  # distance from the middle below which an image has no direction
FEWEST, MOST = 5, 7  # points of a ring that is easy to read
WELL_OFF: Final = 0.5  # distance of an image from the middle that is easy to see
WELL_APART: Final = 0.4  # the same of the nearest neighbour, in the mean distance of all


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """A closed one-ring of d points, and its unit circle."""

    side: PointSide
    centre: int
    vertex: NDArray[np.int32]  # indices of its points (d,), counter-clockwise
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
    def names(self) -> list[str]:
        """Names of its points, such as p₁."""
        return [point_name(self.side.letter, k) for k in range(len(self))]

    @property
    def points(self) -> Floats:
        """The ring's points in the unit frame of their set, shape (d, 2)."""
        return np.asarray(self.side.mesh.points[self.vertex])

    @property
    def middle(self) -> Floats:
        """The centre in the unit frame of its set, shape (2,)."""
        return np.asarray(self.side.mesh.points[self.centre])

    @property
    def sides(self) -> Floats:
        """Lengths b_k of the sides, each after its point, in the unit frame, shape (d,)."""
        return np.asarray(np.hypot(*(np.roll(self.points, -1, axis=0) - self.points).T))

    @property
    def arcs(self) -> Floats:
        """Arcs dA_k of the sides on the circle, in radians, shape (d,)."""
        return np.diff(self.circle.angles, append=2 * math.pi)

    @property
    def sectors(self) -> Floats:
        """Areas of the triangles of the inscribed polygon at the middle, shape (d,)."""
        return np.asarray(np.sin(self.arcs) / 2)

    @property
    def orientation(self) -> float:
        """Rotation in radians of the circle that aligns it with the ring, by least squares."""
        away = as_complex(self.points - self.middle)
        return float(np.angle((as_complex(self.circle.boundary).conj() * away).sum()))


@dataclass(frozen=True, slots=True, eq=False)
class RingPair:
    """The rings of two partners, with equally many points.

    The circles agree best at the cyclic `shift`, by which point k of P's ring is taken for point
    k + shift of Q's, and at a rotation of P's circle by `turn` radians; `true_shift` follows from
    the partners of the points.
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
    def names(self) -> list[str]:
        """Names of the points of P's ring, each with its partner's."""
        return [f"{p} {self.q.names[n]}" for p, n in zip(self.p.names, self.partner, strict=True)]

    @property
    def deviations(self) -> Floats:
        """Angles in radians from the points of P, after the rotation, to their partners, (d,)."""
        off = self.q.circle.angles[self.partner] - self.p.circle.angles - self.turn
        return np.asarray(np.angle(np.exp(1j * off)))

    @property
    def move(self) -> Similarity:
        """The least-squares fit of ring and centre onto ring and centre, in the unit frames."""
        ours = np.vstack([self.p.points, self.p.middle])
        return Similarity.fit(ours, np.vstack([self.q.points[self.partner], self.q.middle]))

    @property
    def transform(self) -> Similarity:
        """The same in the units of the points as given."""
        frames = (ring.side.prepared.frame for ring in (self.p, self.q))
        return between_sets(self.move, *frames)

    @property
    def circle_rotation(self) -> float:
        """Rotation in radians between the circles, each aligned with its ring."""
        return math.remainder(self.turn + self.q.orientation - self.p.orientation, 2 * math.pi)

    @property
    def image_rotation(self) -> float | None:
        """Angle in radians from c_p to c_q, each circle aligned with its ring.

        None where an image is in the middle of its circle, as a regular polygon's is.
        """
        c_p, c_q = as_complex(self.p.circle.image), as_complex(self.q.circle.image)
        if min(abs(c_p), abs(c_q)) < IN_THE_MIDDLE:
            return None
        between = float(np.angle(c_p.conjugate() * c_q))
        return math.remainder(between + self.q.orientation - self.p.orientation, 2 * math.pi)


def best_turn(a: UnitCircle, b: UnitCircle) -> tuple[int, float]:
    """Return the cyclic shift and the rotation in radians at which two circles agree best.

    As in the paper's matcher, the correlation of boundary points and centres' images is largest,
    the image counting as much as the whole boundary.
    """
    d = len(a.angles)
    images = d * complex(as_complex(a.image).conjugate() * as_complex(b.image))
    from_a, onto_b = as_complex(a.boundary).conj(), as_complex(b.boundary)
    agreement = np.array([images + from_a @ np.roll(onto_b, -shift) for shift in range(d)])
    shift = int(np.abs(agreement).argmax())
    return shift, float(np.angle(agreement[shift]))


def as_complex(xy: Floats) -> NDArray[np.complex128]:
    """Return points (..., 2) as x + iy, shape (...)."""
    return np.asarray(xy[..., 0] + 1j * xy[..., 1])


def choose_ring_pair(pair: PointPair, index: int | None = None) -> RingPair:
    """Return the ring that the figures show, with its partner.

    `index` is that of its centre in P; by default the ring is the one of 5 to 7 points that is
    easiest to read, of other sizes where there is none. A `PointSetError` is raised if there is no
    such ring, it is not closed, or it has no partner in Q.
    """
    if index is not None:
        chosen = _ring_pair(pair, index)
        if isinstance(chosen, str):
            raise PointSetError(f"{pair.p.source}: point {index}: {chosen}")
        return chosen
    closed = (_ring_pair(pair, int(i)) for i in pair.p.mesh.interior.nonzero()[0])
    rings = [ring for ring in closed if isinstance(ring, RingPair)]
    if not rings:
        raise PointSetError(
            f"{pair.p.source}: none of its closed one-rings recurs in {pair.q.source}"
        )
    return max(rings, key=_clarity)


def _ring_pair(pair: PointPair, index: int) -> RingPair | str:
    """Return the ring of point `index` of P and its partner, or the reason why there is none."""
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
    shifts = [k for k in range(len(theirs)) if theirs[k:] + theirs[:k] == expected]
    if not shifts:
        return f"the one-ring of its partner, point {other} of the other set, has other points"
    try:
        p, q = Ring.of(pair.p, index), Ring.of(pair.q, other)
    except PointSetError as error:  # rounding has put a point outside its ring
        return f"it has no unit circle ({error})"
    shift, turn = best_turn(p.circle, q.circle)
    return RingPair(p, q, shift, shifts[0], turn)


def _clarity(rings: RingPair) -> tuple[bool, bool, bool, float]:
    """Rank rings: right shift, few points, inside the set; uncrowded, images off the middle."""
    both = rings.p, rings.q
    inside = all(ring.side.mesh.interior[ring.vertex].all() for ring in both)
    narrowest = float(min(min(r.arcs.min(), _spoke_gaps(r.circle).min()) for r in both))
    off_middle = min(math.hypot(*ring.circle.image) for ring in both)
    lengths = [np.hypot(*(ring.points - ring.middle).T) for ring in both]
    nearest = min(float(spokes.min() / spokes.mean()) for spokes in lengths)
    clear = narrowest * min(off_middle, WELL_OFF) * min(nearest, WELL_APART)
    return rings.shift == rings.true_shift, FEWEST <= len(rings.p) <= MOST, inside, clear


def _spoke_gaps(circle: UnitCircle) -> Floats:
    """Return the angles between the spokes at a centre's image, in radians, shape (d,)."""
    spokes = as_complex(circle.boundary - circle.image)
    return np.asarray(np.abs(np.angle(np.roll(spokes, -1) * spokes.conj())))

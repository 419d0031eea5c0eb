"""The two point sets of the figures, and the partners of their points.

Figures are drawn in the unit frames of the sets (`geometry.frames.UnitFrame`), as the matcher
works in them, so that points of any magnitude can be drawn; the transform is in the units given.
In the figures y points up: points of images, whose y points down, are mirrored first (`y_down`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.lab.plots.words import degrees, rotated_and_scaled
from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.random_sets import random_pair
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.affine_transform import AffineTransform
from fpmatch.pointset.geometry.points import as_points
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.prepared_points import prepare_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.paper.prepared_points import PreparedPoints

MOST_POINTS: Final = 2000
"""Points of a set whose triangulation is still legible in a figure."""

EASY_SEED: Final = 165
"""Makes a random pair with a ring of six points that is easy to read."""

RANDOM_POINTS: Final = 40
ETA, LAMBDA = 0.175, 0.428  # jitter and precision of the first rows of the paper's tables
TURN_DEG: Final = (30.0, 330.0)  # of a rotated copy: never so little that it is hard to see
TRUE: Final = "true transform"


@dataclass(frozen=True, slots=True, eq=False)
class PointSide:
    """One of the two sets: its letter, its name in errors, and its triangulation."""

    letter: str
    source: str
    prepared: PreparedPoints  # the way from the points given to the unit frame and back
    mesh: Triangulation  # in the unit frame

    @classmethod
    def of(cls, letter: str, source: str, points: ArrayLike, *, y_down: bool = False) -> PointSide:
        """Triangulate a set, or refuse one that is too large or has no closed one-ring."""
        given = as_points(points, source) * (1.0, -1.0 if y_down else 1.0)
        if len(given) > MOST_POINTS:
            raise PointSetError(
                f"{source}: {len(given)} points, but a figure shows at most {MOST_POINTS}"
            )
        try:
            prepared = prepare_points(given)
        except PointSetError as error:
            raise PointSetError(f"{source}: {str(error).removeprefix('points: ')}") from error
        side = cls(letter, source, prepared, triangulate(prepared.unit.T))
        if not side.mesh.interior.any():
            raise PointSetError(
                f"{source}: none of its {len(prepared)} points has a closed one-ring"
            )
        return side

    def length(self, in_frame: float) -> float:
        """Return a length of the unit frame in the units of the points as given."""
        return math.ldexp(in_frame, self.prepared.frame.exponent)


@dataclass(frozen=True, slots=True, eq=False)
class PointPair:
    """Two sets, their partners, and the transform of one onto the other."""

    p: PointSide
    q: PointSide
    pairs: NDArray[np.int32]  # (K, 2), into P and into Q
    transform: Similarity  # of P onto Q in the units given: the truth, or the matcher's result
    origin: str  # a sentence on the origin of Q and of the transform
    transform_name: str
    y_down: bool = False  # whether y of the points given pointed down, so that sets are mirrored


def random_point_pair(seed: int) -> PointPair:
    """Make a random set P of 40 points, and Q from it: rotated, scaled, shifted and jittered."""
    made = random_pair(RANDOM_POINTS, RANDOM_POINTS, 1.0, ETA, LAMBDA, rng=seed)
    if made.transform is None:  # pragma: no cover - only independent sets have none
        raise PointSetError("independent sets have no rings that correspond")
    changed = rotated_and_scaled(made.transform)
    origin = f"Q is P {changed}, and jittered (random sets, seed {seed})."
    name = f"random set of seed {seed}"
    p, q = PointSide.of("P", name, made.p), PointSide.of("Q", name, made.q)
    return PointPair(p, q, made.pairs, made.transform, origin, TRUE)


def rotated_point_pair(
    points: ArrayLike, source: str, seed: int, *, y_down: bool = False
) -> PointPair:
    """Make Q from P, (N, 2), by a rotation about its mean, of an angle that `seed` draws.

    Point i of P is the partner of point i of Q. `source` is the name of P in errors, such as that
    of its file; `y_down` indicates that y of the points points down, as in images. A
    `PointSetError` is raised if P is malformed, too large to draw, or has no closed one-ring.
    """
    p = PointSide.of("P", source, points, y_down=y_down)
    given = p.prepared.points
    angle = math.radians(np.random.default_rng(seed).uniform(*TURN_DEG))
    turn = Similarity(rotation=math.remainder(angle, 2 * math.pi))
    middle = given.mean(axis=0)
    tx, ty = (middle - turn.apply(middle[None])[0]).tolist()
    transform = Similarity(1.0, turn.rotation, tx, ty)
    q = PointSide.of("Q", f"{source}, rotated", turn.apply(given - middle) + middle)
    pairs = np.repeat(np.arange(len(given), dtype=np.int32)[:, None], 2, axis=1)
    origin = f"Q is P rotated by {degrees(transform.rotation)}."
    return PointPair(p, q, pairs, transform, origin, TRUE, y_down)


def matched_point_pair(
    p: ArrayLike,
    q: ArrayLike,
    p_source: str,
    q_source: str,
    *,
    y_down: bool = False,
    reflect: bool = False,
) -> PointPair:
    """Take two given sets, and their partners from `match_points`.

    The parameters are those of `rotated_point_pair`, for either set; so are the errors, of which
    there is one for sets that do not match. With `reflect`, a set that matches mirrored is drawn
    mirrored.
    """
    of_p = PointSide.of("P", p_source, p, y_down=y_down)
    of_q = PointSide.of("Q", q_source, q, y_down=y_down)
    match = match_points(of_p.prepared.points, of_q.prepared.points, reflect=reflect)
    transform, mirrored = match.transform, ""
    if isinstance(transform, AffineTransform):  # mirrored: the rest is the map of the mirror image
        of_p = PointSide.of("P", p_source, of_p.prepared.points * (1.0, -1.0))
        in_p, in_q = match.pairs.T
        both = of_p.prepared.points[in_p], of_q.prepared.points[in_q]
        transform, mirrored = Similarity.fit(*both), "mirrored, "
    if transform is None:
        raise PointSetError(f"{p_source} and {q_source}: they do not match")
    changed = f"{mirrored}{rotated_and_scaled(transform)}"
    origin = f"The matcher pairs {len(match.pairs)} points: Q is P {changed}."
    return PointPair(of_p, of_q, match.pairs, transform, origin, "matcher, all points", y_down)

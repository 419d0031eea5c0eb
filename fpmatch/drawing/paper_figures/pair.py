"""The two point sets that the pictures of the paper are drawn from, and which points are partners.

Pictures are drawn in the sets' unit frames (`fpmatch.pointset.points.UnitFrame`), as the matcher
works in them, so that points of any magnitude can be drawn; the transform is in the units given.

The pictures have y pointing up. Points of images, whose y points down, are mirrored first
(`upright`), so that they stand as the image does, and angles are counter-clockwise on screen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.paper_figures.words import degrees, moved_by
from fpmatch.errors import PointSetError
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.match import match_points
from fpmatch.pointset.points import as_points
from fpmatch.pointset.random_sets import random_pair
from fpmatch.pointset.similarity import Similarity
from fpmatch.pointset.unit_circle.prepared_points import prepare_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.pointset.delaunay.triangulation import Triangulation
    from fpmatch.pointset.unit_circle.prepared_points import PreparedPoints

MOST_POINTS: Final = 2000
"""Points of a set whose triangulation can still be made out in a picture."""

EASY_SEED: Final = 165
"""Makes a random pair in which a ring of six points can be followed with ease."""

RANDOM_POINTS: Final = 40
ETA: Final = 0.175  # jitter and precision of the first rows of the paper's tables
LAMBDA: Final = 0.428
MADE: Final = "as it was made"
TURN_DEG: Final = (30.0, 330.0)  # of a rotated copy: never so little that it is hard to see


@dataclass(frozen=True, slots=True, eq=False)
class PointSide:
    """Hold one of the two sets: its letter, what errors call it, and its triangulation.

    `mesh` is in the set's unit frame; `prepared` leads back to the points as given.
    """

    letter: str
    source: str
    prepared: PreparedPoints
    mesh: Triangulation

    @classmethod
    def of(cls, letter: str, source: str, points: ArrayLike) -> PointSide:
        """Triangulate a set, or refuse one of which there is nothing to draw."""
        given = as_points(points, source)
        if len(given) > MOST_POINTS:
            raise PointSetError(
                f"{source}: {len(given)} points, but a picture shows at most {MOST_POINTS}"
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
    """Hold two sets, their partners, and where all this comes from.

    Parameters
    ----------
    p, q : PointSide
        The sets.
    pairs : ndarray of int32, shape (K, 2)
        Partners (into P, into Q).
    transform : Similarity
        Maps P onto Q, in the units given: the truth, or what the matcher found.
    origin : str
        A sentence on where Q and the transform come from.
    known_as : str
        What the transform is called beside others.
    y_down : bool
        Whether y of the points given pointed down, so that the sets, and the transform between
        them, are those of the mirrored points.
    """

    p: PointSide
    q: PointSide
    pairs: NDArray[np.int32]
    transform: Similarity
    origin: str
    known_as: str
    y_down: bool = False


def random_point_pair(seed: int) -> PointPair:
    """Make a random set P, and Q from it: rotated, scaled, shifted and jittered.

    Parameters
    ----------
    seed : int
        The same seed makes the same pair.

    Returns
    -------
    PointPair
        Sets of 40 points, jittered as in the first rows of the paper's tables (η = 0.175).

    Examples
    --------
    >>> len(random_point_pair(1).pairs)
    40
    """
    made = random_pair(RANDOM_POINTS, RANDOM_POINTS, 1.0, ETA, LAMBDA, rng=seed)
    if made.transform is None:  # pragma: no cover - only independent sets have none
        raise PointSetError("independent sets have no rings that correspond")
    origin = f"Q is P {moved_by(made.transform)}, and jittered (random sets, seed {seed})."
    name = f"random set of seed {seed}"
    p, q = PointSide.of("P", name, made.p), PointSide.of("Q", name, made.q)
    return PointPair(p, q, made.pairs, made.transform, origin, MADE)


def upright(points: ArrayLike, *, y_down: bool = True) -> NDArray[np.float64]:
    """Return points whose y points down with y pointing up, so that pictures show them upright.

    Parameters
    ----------
    points : array_like of float, shape (N, 2)
        The points.
    y_down : bool
        Whether their y points down; if not, they stay as they are.

    Returns
    -------
    ndarray of float64, shape (N, 2)
        The points, y negated.

    Examples
    --------
    >>> upright([[3.0, 4.0]]).tolist()
    [[3.0, -4.0]]
    """
    given = as_points(points)
    return given * (1.0, -1.0) if y_down else given


def rotated_point_pair(
    points: ArrayLike, source: str, seed: int, *, y_down: bool = False
) -> PointPair:
    """Take P as given, and make Q from it by a rotation about its mean.

    Parameters
    ----------
    points : array_like of float, shape (N, 2)
        P.
    source : str
        What errors call it, such as the name of its file.
    seed : int
        Gives the angle, between 30 and 330 degrees.
    y_down : bool
        Whether y of the points points down, as in images.

    Returns
    -------
    PointPair
        The sets; point i of the one is the partner of point i of the other.

    Raises
    ------
    PointSetError
        If P is malformed, too large to draw, or has no closed one-ring.

    Examples
    --------
    >>> cross = [[0, 0], [4, 0], [4, 4], [0, 5], [2, 1]]
    >>> rotated_point_pair(cross, "cross", 1).transform.scale
    1.0
    """
    p = PointSide.of("P", source, upright(as_points(points, source), y_down=y_down))
    given = p.prepared.points
    angle = math.radians(np.random.default_rng(seed).uniform(*TURN_DEG))
    turn = Similarity(rotation=math.remainder(angle, 2 * math.pi))
    middle = given.mean(axis=0)
    shift = middle - turn.apply(middle[None])[0]
    transform = Similarity(1.0, turn.rotation, float(shift[0]), float(shift[1]))
    q = PointSide.of("Q", f"{source}, rotated", turn.apply(given - middle) + middle)
    index = np.arange(len(given), dtype=np.int32)
    origin = f"Q is P rotated by {degrees(transform.rotation_deg)}."
    return PointPair(p, q, np.column_stack([index, index]), transform, origin, MADE, y_down)


def matched_point_pair(
    p: ArrayLike, q: ArrayLike, p_source: str, q_source: str, *, y_down: bool = False
) -> PointPair:
    """Take both sets as given, and their partners from the matcher.

    Parameters
    ----------
    p, q : array_like of float, shape (N, 2) and (M, 2)
        The sets.
    p_source, q_source : str
        What errors call them.
    y_down : bool
        Whether y of the points of both points down, as in images.

    Returns
    -------
    PointPair
        The sets and the pairs that `match_points` finds.

    Raises
    ------
    PointSetError
        If a set is malformed, too large to draw, or has no closed one-ring; or they do not match.
    """
    sides = (
        PointSide.of("P", p_source, upright(as_points(p, p_source), y_down=y_down)),
        PointSide.of("Q", q_source, upright(as_points(q, q_source), y_down=y_down)),
    )
    match = match_points(*(side.prepared.points for side in sides))
    if match.transform is None:
        raise PointSetError(
            f"{p_source} and {q_source}: they do not match, so no ring of one has its partner in "
            "the other"
        )
    origin = f"The matcher pairs {len(match.pairs)} points: Q is P {moved_by(match.transform)}."
    return PointPair(*sides, match.pairs, match.transform, origin, "matcher, all points", y_down)

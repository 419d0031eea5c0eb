"""Random pairs of point sets with known truth, as in the paper's section 4.2.

All lengths are relative to the density. Of n random points in a square of side r, the mean distance
from a point to its nearest neighbour is r/(2√n), apart from the edge of the square (Clark, Evans,
"Distance to nearest neighbor as a measure of spatial relationships in populations", Ecology 35,
1954). With Q such a set of n points,

- the matching distance of eq. (2) is ``t = λ·r/(2√n)``: λ mean nearest-neighbour distances;
- the jitter between partners is uniform in a disc of radius ``η·r/(2√n)``;
- ρ is the share of P's m points that have a partner in Q: ⌈ρm⌉ points, so that the truth satisfies
  a matcher that needs ρm pairs. The others are random in the area of P, independently.

The paper does not say which part of Q the partners come from; there are two models:

- "patch": P covers a sub-square of Q's square, of side r·√(m/n) and at a random position. P and Q
  have the same density n/r². Most of P's one-rings and neighbours recur in Q.
- "clutter": P's partners are spread over all of Q's square. Q is n/m times as dense as P, and
  neighbours in P are not neighbours in Q.

P is then moved by a random similarity; the truth is the inverse transform.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from fpmatch.errors import PointSetError, number_text
from fpmatch.pointset.geometry.point_match import share_of
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

PointModel = Literal["patch", "clutter"]
POINT_MODELS: Final[tuple[PointModel, ...]] = get_args(PointModel)

MIN_SCALE: Final = 0.5
MAX_SCALE: Final = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class RandomPair:
    """A random pair of point sets and the truth about it."""

    p: Floats  # (m, 2): the pattern, in a frame of its own
    q: Floats  # (n, 2): the target, in the square [0, √n]², one point a unit of area
    pairs: NDArray[np.int32]  # (K, 2): true pairs (into p, into q), sorted by the first
    transform: Similarity | None  # of p onto q; None for independent sets
    tolerance: float  # the matching distance t, in the units of q
    jitter: float  # largest distance of true partners, in the units of q


def random_pair(
    m: int,
    n: int,
    rho: float,
    eta: float,
    lambda_: float,
    *,
    model: PointModel = "patch",
    rng: np.random.Generator | int,
) -> RandomPair:
    """Make a random pair of sets of `m` and `n` points, of which ⌈ρm⌉ are partners.

    `eta` and `lambda_` are η and λ of this module, in mean nearest-neighbour distances of Q; `rng`
    is the source of randomness or its seed: the same seed gives the same pair.
    """
    if not 0 <= rho <= 1:
        raise PointSetError(f"rho must be in [0, 1], not {number_text(rho)}")
    if not 1 <= m <= n:
        raise PointSetError(f"P needs 1 to n points, Q at least as many: {m} and {n}")
    if not (0 <= eta < math.inf and 0 <= lambda_ < math.inf):
        raise PointSetError(
            f"eta and lambda must be 0 or more, not {number_text(eta)} and {number_text(lambda_)}"
        )
    if model not in POINT_MODELS:
        raise PointSetError(f"unknown model {model!r}: expected {' or '.join(POINT_MODELS)}")
    rng = np.random.default_rng(rng)
    partners, side = share_of(rho, m), math.sqrt(n)
    spacing = 0.5  # r/(2√n): Q has one point a unit of area
    sample = _patch if model == "patch" else _clutter
    q, q_partner, outliers = sample(m, n, partners, side, rng)
    p_in_q = np.vstack([q[q_partner] + _in_disc(partners, eta * spacing, rng), outliers])
    order = rng.permutation(m)
    rank = order.argsort().astype(np.int32)  # position of each point in P
    pairs = np.column_stack([rank[:partners], q_partner]).astype(np.int32)
    move = _random_similarity(side, rng)
    return RandomPair(
        p=move.apply(p_in_q[order]),
        q=q,
        pairs=pairs[pairs[:, 0].argsort()],
        transform=move.inverse() if partners else None,
        tolerance=lambda_ * spacing,
        jitter=eta * spacing,
    )


def independent_pair(
    m: int, n: int, lambda_: float, *, model: PointModel = "patch", rng: np.random.Generator | int
) -> RandomPair:
    """Make two independent sets of the densities of `random_pair`: no pairs and no transform."""
    return random_pair(m, n, 0.0, 0.0, lambda_, model=model, rng=rng)


def _patch(
    m: int, n: int, partners: int, side: float, rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Return Q, the indices of its partners in a sub-square, and P's points without one."""
    patch_side = side * math.sqrt(m / n)
    corner = rng.uniform(0.0, side - patch_side, 2)
    inside = corner + rng.uniform(0.0, patch_side, (m, 2))
    order = rng.permutation(n)
    outside = np.empty((0, 2))
    while len(outside) < n - m:
        tried = rng.uniform(0.0, side, (n, 2))  # n - m of them fall outside, on average
        in_patch = ((tried >= corner) & (tried < corner + patch_side)).all(axis=1)
        outside = np.vstack([outside, tried[~in_patch]])
    q = np.vstack([inside, outside[: n - m]])[order]
    outliers = corner + rng.uniform(0.0, patch_side, (m - partners, 2))
    return q, order.argsort()[:partners], outliers


def _clutter(
    m: int, n: int, partners: int, side: float, rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Return Q, the indices of its partners anywhere in the square, and P's other points."""
    q = rng.uniform(0.0, side, (n, 2))
    outliers = rng.uniform(0.0, side, (m - partners, 2))
    return q, rng.permutation(n)[:partners], outliers


def _in_disc(count: int, radius: float, rng: np.random.Generator) -> Floats:
    """Return `count` shifts, uniform over the disc of `radius`."""
    distance = radius * np.sqrt(rng.random(count))
    angle = rng.uniform(0.0, 2 * np.pi, count)
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])


def _random_similarity(side: float, rng: np.random.Generator) -> Similarity:
    """Return any rotation, a log-uniform scale, and a shift of up to the side."""
    scale = math.exp(rng.uniform(math.log(MIN_SCALE), math.log(MAX_SCALE)))
    shift = rng.uniform(-side, side, 2)
    return Similarity(scale, rng.uniform(-math.pi, math.pi), float(shift[0]), float(shift[1]))

"""Point sets that are not uniform: clusters, lines, lattices, repeats, curves and power laws."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

Task = Literal["copy", "part", "independent"]
TASKS: Final[tuple[Task, ...]] = get_args(Task)

SIDE: Final = 100.0
TIGHT: Final = 0.1  # standard deviation of a cluster
REPLACED: Final = 0.2  # share of the points of a part that have no partner
UNIFORM: Final = "uniform"


def _uniform(rng: np.random.Generator, n: int) -> Floats:
    return rng.uniform(0, SIDE, (n, 2))


def _ten_clusters(rng: np.random.Generator, n: int) -> Floats:
    return _uniform(rng, 10)[rng.integers(0, 10, n)] + rng.normal(0, TIGHT, (n, 2))


def _one_cluster(rng: np.random.Generator, n: int) -> Floats:
    points = rng.normal(0, TIGHT / 10, (n, 2))
    few = max(4, n // 50)
    points[:few] = rng.uniform(-SIDE, SIDE, (few, 2))
    return points


def _clusters_and_noise(rng: np.random.Generator, n: int) -> Floats:
    points = _ten_clusters(rng, n)
    points[: n // 3] = _uniform(rng, n // 3)
    return points


def _two_far_clusters(rng: np.random.Generator, n: int) -> Floats:
    points = rng.uniform(0, 1, (n, 2))
    points[n // 2 :] += 1e6
    return points


def _nearly_on_a_line(rng: np.random.Generator, n: int) -> Floats:
    return np.column_stack([rng.uniform(0, SIDE, n), rng.normal(0, 1e-5 * SIDE, n)])


def _lattice(_: np.random.Generator, n: int) -> Floats:
    column, row = np.divmod(np.arange(n), math.isqrt(n - 1) + 1)
    return np.column_stack([column, row]).astype(np.float64)


def _every_point_twice(rng: np.random.Generator, n: int) -> Floats:
    points = _uniform(rng, -(-n // 2))
    return np.vstack([points, points])[:n]


def _many_equal(rng: np.random.Generator, n: int) -> Floats:
    points = _uniform(rng, max(8, n // 10))
    return np.vstack([points, np.repeat(points[:1], n - len(points), axis=0)])


def _spiral(rng: np.random.Generator, n: int) -> Floats:
    radius = np.sort(rng.random(n))
    return _polar(SIDE * radius, 12 * math.pi * radius)


def _power_law(rng: np.random.Generator, n: int) -> Floats:
    return _polar(np.minimum(rng.random(n) ** -2.0, 1e6), rng.uniform(0, 2 * math.pi, n))


def _circle(rng: np.random.Generator, n: int) -> Floats:
    return _polar(np.full(n, SIDE), rng.uniform(0, 2 * math.pi, n))


def _polar(radius: Floats, angle: Floats) -> Floats:
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


ARRANGEMENTS: Final[Mapping[str, Callable[[np.random.Generator, int], Floats]]] = {
    UNIFORM: _uniform,
    "ten clusters": _ten_clusters,
    "one cluster": _one_cluster,
    "clusters and noise": _clusters_and_noise,
    "two far clusters": _two_far_clusters,
    "nearly on a line": _nearly_on_a_line,
    "lattice": _lattice,
    "every point twice": _every_point_twice,
    "many equal": _many_equal,
    "spiral": _spiral,
    "power law": _power_law,
    "circle": _circle,
}
"""Functions that make N points (N, 2), N at least 8, by the name of the arrangement."""


def arranged_pair(name: str, n: int, task: Task) -> tuple[Floats, Floats, Similarity | None]:
    """Return P, Q in another order, and the transform of P onto Q, None for independent sets."""
    rng = np.random.default_rng(0)
    make = ARRANGEMENTS[name]
    p = make(rng, n)
    if task == "independent":
        return p, make(rng, n), None
    truth = Similarity(2.0, float(rng.uniform(-math.pi, math.pi)), 10.0, -4.0)
    q = truth.apply(p)
    if task == "part":
        replaced = rng.random(n) < REPLACED
        q[replaced] = truth.apply(make(rng, n))[replaced]
    return p, q[rng.permutation(n)], truth

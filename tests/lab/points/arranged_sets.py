"""Point sets that are not uniform: clusters, lines, lattices, repeats, curves and power laws."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

SIDE: Final = 100.0
TIGHT: Final = 0.1  # standard deviation of a cluster
REPLACED: Final = 0.2  # share of the points of a part that have no partner


def _uniform(rng: np.random.Generator, n: int) -> Floats:
    return rng.uniform(0, SIDE, (n, 2))


def _one_cluster(rng: np.random.Generator, n: int) -> Floats:
    points = rng.normal(0, TIGHT / 10, (n, 2))
    few = max(4, n // 50)
    points[:few] = rng.uniform(-SIDE, SIDE, (few, 2))
    return points


def _nearly_on_a_line(rng: np.random.Generator, n: int) -> Floats:
    return np.column_stack([rng.uniform(0, SIDE, n), rng.normal(0, 1e-5 * SIDE, n)])


def _lattice(_: np.random.Generator, n: int) -> Floats:
    column, row = np.divmod(np.arange(n), math.isqrt(n - 1) + 1)
    return np.column_stack([column, row]).astype(np.float64)


def _many_equal(rng: np.random.Generator, n: int) -> Floats:
    points = _uniform(rng, max(8, n // 10))
    return np.vstack([points, np.repeat(points[:1], n - len(points), axis=0)])


def _power_law(rng: np.random.Generator, n: int) -> Floats:
    return _polar(np.minimum(rng.random(n) ** -2.0, 1e6), rng.uniform(0, 2 * math.pi, n))


def _polar(radius: Floats, angle: Floats) -> Floats:
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


ARRANGEMENTS: Final[Mapping[str, Callable[[np.random.Generator, int], Floats]]] = {
    "uniform": _uniform,
    "one cluster": _one_cluster,
    "nearly on a line": _nearly_on_a_line,
    "many equal": _many_equal,
    "power law": _power_law,
}
"""Functions that make N points (N, 2), N at least 8, by the name of the arrangement."""


def arranged_part(name: str, n: int) -> tuple[Floats, Floats, Similarity]:
    """Return P, a copy of which some points are replaced, and the transform of P onto it."""
    rng = np.random.default_rng(0)
    p, truth = ARRANGEMENTS[name](rng, n), Similarity(2.0, 2.5, 10.0, -4.0)
    replaced = rng.random(n) < REPLACED
    q = truth.apply(np.where(replaced[:, None], ARRANGEMENTS[name](rng, n), p))
    return p, q[rng.permutation(n)], truth


def _row(n: int, x: float = 0.0, y: float = 0.0) -> Floats:
    return np.column_stack([x + 15.0 * np.arange(n), np.full(n, y)])


def _beside(rng: np.random.Generator, n: int) -> Floats:
    return np.column_stack([rng.uniform(0, 450, n), rng.uniform(-100, 100, n)])


def _ruler(few: int) -> Callable[[np.random.Generator], Floats]:
    return lambda rng: np.vstack([_row(30), _beside(rng, few)])


def _track(rng: np.random.Generator) -> Floats:
    angle = rng.normal(0, 0.25, 60).cumsum()
    return _polar(rng.uniform(8, 12, 60), angle).cumsum(axis=0)


def _grid_with_holes(rng: np.random.Generator) -> Floats:
    return 15.0 * _lattice(rng, 64)[rng.permutation(64)[20:]]


def _clock(rng: np.random.Generator) -> Floats:
    ticks = _polar(np.full(60, SIDE), np.linspace(0, 2 * math.pi, 60, endpoint=False))
    return np.vstack([ticks, rng.uniform(-60, 60, (4, 2))])


def _stars(rng: np.random.Generator) -> Floats:
    """Return a field of stars with an open cluster in it."""
    cluster = rng.normal(0, 8, (30, 2)) + rng.uniform(50, 250, 2)
    return np.vstack([rng.uniform(0, 300, (60, 2)), cluster])


def _comb(rng: np.random.Generator) -> Floats:
    """Return six repeats of five points, and five others."""
    part, shifts = rng.uniform(0, 60, (5, 2)), np.column_stack([60.0 * np.arange(6), np.zeros(6)])
    repeats = (part + shifts[:, None]).reshape(-1, 2)
    return np.vstack([repeats, rng.uniform(0, 1, (5, 2)) * [360, 70]])


def _full_grid(rng: np.random.Generator) -> Floats:
    return np.vstack([10.0 * _lattice(rng, 49), rng.uniform(0, 70, (6, 2))])


def _dense_core(rng: np.random.Generator) -> Floats:
    return np.vstack([rng.normal(0, 5, (300, 2)), rng.uniform(-SIDE, SIDE, (60, 2))])


def _one_course(rng: np.random.Generator) -> Floats:
    x = rng.uniform(0, 400, 60)
    return np.column_stack([x, 60 * np.sin(x / 40) + 20 * np.sin(x / 13)])


COPIED: Final[Mapping[str, Callable[[np.random.Generator], Floats]]] = {
    "uniform": lambda rng: _uniform(rng, 40),
    "row and 3 points": _ruler(3),
    "track": _track,
    "grid with holes": _grid_with_holes,
    "clock": _clock,
    "dense core": _dense_core,
    "stars": _stars,
    "repeats and 5 points": _comb,
    "grid and 6 points": _full_grid,
}
"""Sets whose copies are to be matched, by kind."""

INDEPENDENT: Final[Mapping[str, Callable[[np.random.Generator], Floats]]] = {
    "uniform": lambda rng: _uniform(rng, 60),
    "grid with holes": _grid_with_holes,
    "track": _track,
    "dense core": _dense_core,
    "common row and 10 points": _ruler(10),
    "points of one course": _one_course,
    "common clock": _clock,
    "stars": _stars,
    "common grid and 6 points": _full_grid,
}
"""Sets of which two are independent but for the structure that the kind has, which is no match."""


def copied_pair(kind: str, seed: int, jitter: float = 0.0) -> tuple[Floats, Floats, Similarity]:
    """Return a set of `COPIED`, its copy in another order, and the transform between them."""
    rng = np.random.default_rng(seed)
    p, truth = COPIED[kind](rng), Similarity(1.5, math.radians(25), 3.0, 4.0)
    q = truth.apply(p) + rng.normal(0, jitter, p.shape) if jitter else truth.apply(p)
    return p, q[rng.permutation(len(q))], truth


def independent_sets(kind: str, seed: int) -> tuple[Floats, Floats]:
    """Return two sets of a kind of `INDEPENDENT`, the second turned and scaled."""
    rng = np.random.default_rng(seed)
    p, q = INDEPENDENT[kind](rng), INDEPENDENT[kind](rng)
    return p, Similarity(1.5, 0.4, 3.0, 4.0).apply(q)[rng.permutation(len(q))]

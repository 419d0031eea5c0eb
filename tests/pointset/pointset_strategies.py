"""Point sets for property tests, and what holds of every match."""

import math

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.pointset.geometry.frames import UnitFrame
from fpmatch.pointset.geometry.points import sort_into_cells
from fpmatch.pointset.geometry.similarity import Similarity

MAX_POINTS = 16

any_finite_points = st.integers(0, MAX_POINTS).flatmap(
    lambda n: arrays(np.float64, (n, 2), elements=st.floats(-(2.0**300), 2.0**300))
)
"""Anything accepted: 0 to 16 points of any magnitude, often coincident."""

crowded_pixels = st.integers(0, MAX_POINTS).flatmap(
    lambda n: arrays(np.float64, (n, 2), elements=st.integers(0, 5).map(float))
)
"""Whole pixels on a 6 x 6 grid: coincident, collinear and co-circular points abound."""

seeds = st.integers(0, 2**32 - 1)
"""Seeds of random points in general position."""


def even_points(seed, n):
    """Return points in general position, (N, 2), in the unit square."""
    return np.random.default_rng(seed).uniform(0, 1, (n, 2))


def similarities(change, shift):
    """Return transforms of any rotation that change scales and shift by so much at most."""
    return st.builds(
        Similarity,
        scale=st.floats(1 / change, change),
        rotation=st.floats(-math.pi, math.pi),
        tx=st.floats(-shift, shift),
        ty=st.floats(-shift, shift),
    )


def as_move(transform):
    """Return the (s·cos θ, s·sin θ, tx, ty) of kernels."""
    return np.array([*transform.matrix[:, 0], transform.tx, transform.ty])


def moved(points, move):
    """Return points (2, N) under a move of kernels."""
    a, b, tx, ty = move
    return np.array([[a, -b], [b, a]]) @ points + [[tx], [ty]]


def in_columns(points):
    """Return points (N, 2) as kernels take them, shape (2, N)."""
    return np.array(points.T, order="C")


def grid_of(points, side, margin=0.0):
    """Sort points (2, N) into a grid that holds them with a margin."""
    low, high = (points.min(axis=1), points.max(axis=1)) if points.size else ([0, 0], [1, 1])
    low, high = np.subtract(low, margin).tolist(), np.add(high, margin).tolist()
    return sort_into_cells(points, side, low=tuple(low), high=tuple(high))


def places(grid):
    """Return the points (2, N) in the order of the grid."""
    return np.array([grid.x, grid.y])


def squared_distances(grid, x, y):
    return (np.asarray(grid.x) - x) ** 2 + (np.asarray(grid.y) - y) ** 2


def worn(p, move, seed, jitter=0.02, share=0.2):
    """Return a moved copy in another order, jittered and a share of it outliers; and that order.

    The jitter is in mean spacings of points over the unit square. Point i of `p` is point
    ``place[i]`` of the copy.
    """
    rng = np.random.default_rng(seed)
    q = move.apply(p + rng.normal(0, jitter / math.sqrt(len(p)), p.shape))
    gone = rng.permutation(len(p))[: int(share * len(p))]
    q[gone] = rng.uniform(q.min(axis=0), q.max(axis=0), (len(gone), 2))
    order = rng.permutation(len(p))
    return q[order], order.argsort()


def check_sound(match, p, q):
    """Check that a result agrees with itself."""
    assert match.pairs.dtype == np.int32
    assert match.pairs.shape == (len(match.pairs), 2)
    assert match.pairs[:, 0].tolist() == sorted(set(match.pairs[:, 0].tolist()))
    assert len(set(match.pairs[:, 1].tolist())) == len(match.pairs)
    if match.transform is None:
        assert (len(match.pairs), match.matched_share, match.rms) == (0, 0.0, 0.0)
        assert match.chance is None
        return
    assert match.local_matches > 0
    # of all points, or of the distinct ones
    smaller = {min(len(p), len(q)), min(len(np.unique(of, axis=0)) for of in (p, q))}
    assert match.matched_share in {len(match.pairs) / number for number in smaller}
    assert match.chance is None or match.chance < 1e-3
    residual = match.transform.apply(p[match.pairs[:, 0]]) - q[match.pairs[:, 1]]
    rms = math.sqrt((residual**2).sum(axis=1).mean())
    assert match.rms == pytest.approx(rms, rel=1e-6, abs=1e-9 * max(1, np.abs(q).max()))


def beyond_reach(points):
    """Tell whether the extent is smaller than matchers accept."""
    return UnitFrame.of(points).exponent < -300

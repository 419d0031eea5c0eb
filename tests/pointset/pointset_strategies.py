"""Point sets for property tests, and what holds of every match."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.pointset.frames import MAX_EXPONENT, UnitFrame
from fpmatch.pointset.point_match import PointMatch

MAX_POINTS = 16

any_finite_points = st.integers(0, MAX_POINTS).flatmap(
    lambda n: arrays(np.float64, (n, 2), elements=st.floats(allow_nan=False, allow_infinity=False))
)
"""Anything finite: 0 to 16 points of any magnitude, often coincident."""

crowded_pixels = st.integers(0, MAX_POINTS).flatmap(
    lambda n: arrays(np.float64, (n, 2), elements=st.integers(0, 5).map(float))
)
"""Whole pixels on a 6 x 6 grid: coincident, collinear and co-circular points abound."""

seeds = st.integers(0, 2**32 - 1)
"""Seeds of random points in general position."""


def check_sound(match: PointMatch, p: np.ndarray, q: np.ndarray) -> None:
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
    assert match.matched_share == len(match.pairs) / min(len(p), len(q)) > 0
    assert match.chance is None or match.chance < 1e-3
    residual = match.transform.apply(p[match.pairs[:, 0]]) - q[match.pairs[:, 1]]
    rms = math.sqrt((residual**2).sum(axis=1).mean())
    assert match.rms == pytest.approx(rms, rel=1e-6, abs=1e-9 * max(1, np.abs(q).max()))


def beyond_reach(points: np.ndarray) -> bool:
    """Tell whether coordinates or extent lie beyond the exponents that are accepted."""
    frame = UnitFrame.of(points)
    return len(points) > 0 and max(frame.magnitude, -frame.exponent) > MAX_EXPONENT

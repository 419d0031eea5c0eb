"""Point sets for property tests: hostile floats, crowded whole pixels, random seeds."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

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

"""Unit deviation, smooth over its extent, the same for a seed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.synthesis.noise import smooth_noise


@given(st.integers(1, 90), st.integers(1, 90), st.floats(1.5, 200), st.integers(0, 2**32))
def test_any_shape_and_extent_gives_finite_values(
    rows: int, columns: int, extent: float, seed: int
) -> None:
    field = smooth_noise((rows, columns), extent, np.random.default_rng(seed))
    assert field.shape == (rows, columns)
    assert np.isfinite(field).all()
    steps = [np.abs(np.diff(field, axis=axis)) for axis in (0, 1)]
    assert all(step.max(initial=0) < 12 / extent for step in steps)


@pytest.mark.parametrize("extent", [2.0, 5.0, 7.3])
def test_mean_is_nought_and_deviation_one(extent: float, rng: np.random.Generator) -> None:
    field = smooth_noise((300, 400), extent, rng)
    assert abs(field.mean()) < 0.1
    assert abs(field.std() - 1) < 0.1


def test_far_places_know_nothing_of_each_other(rng: np.random.Generator) -> None:
    field = smooth_noise((400, 400), 5.0, rng)
    near = np.corrcoef(field[:, :-2].ravel(), field[:, 2:].ravel())[0, 1]
    far = np.corrcoef(field[:, :-20].ravel(), field[:, 20:].ravel())[0, 1]
    assert near > 0.8
    assert abs(far) < 0.1

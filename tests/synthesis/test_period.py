"""About nine pixels, smooth, wider at the joint, a finger's own."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.synthesis.period import PERIOD_LEVELS, PeriodParameters, ridge_period

SHAPE = (200, 160)


@given(st.integers(0, 2**32))
def test_a_map_is_natural_and_smooth(seed: int) -> None:
    period = ridge_period(SHAPE, np.random.default_rng(seed))
    assert period.dtype == np.float32
    assert period.shape == SHAPE
    assert 5.5 < period.min() <= period.max() < 13.5
    assert np.abs(np.diff(period, axis=0)).max() < 0.3
    assert not np.mod(period * PERIOD_LEVELS, 1).any()


def test_fingers_differ_about_their_mean() -> None:
    maps = [ridge_period(SHAPE, np.random.default_rng(seed)) for seed in range(60)]
    means = [float(period.mean()) for period in maps]
    assert 8.3 < np.mean(means) < 9.3
    assert 0.3 < np.std(means) < 0.8
    rows = np.mean(maps, axis=(0, 2))
    assert rows[-20:].mean() > rows[:20].mean() + 0.5


def test_without_variation_only_the_slope_is_left(rng: np.random.Generator) -> None:
    even = PeriodParameters(between_fingers_px=0, variation_share=0, tip_share=0, joint_share=0)
    np.testing.assert_allclose(ridge_period(SHAPE, rng, even), even.mean_px, atol=1 / PERIOD_LEVELS)

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.lab.synthesis.sensor import draw_card
from fpmatch.lab.synthesis.skin import draw_lines


@given(st.integers(1, 90), st.integers(1, 90), st.floats(1.5, 200), st.integers(0, 2**32))
def test_noise_of_any_shape_and_extent_is_finite_and_smooth(rows, columns, extent, seed):
    field = smooth_noise((rows, columns), extent, np.random.default_rng(seed))
    assert field.shape == (rows, columns)
    assert np.isfinite(field).all()
    steps = [np.abs(np.diff(field, axis=axis)) for axis in (0, 1)]
    assert all(step.max(initial=0) < 12 / extent for step in steps)


@pytest.mark.parametrize("extent", [2.0, 5.0, 7.3])
def test_noise_has_mean_0_deviation_1_and_a_length(extent, rng):
    field = smooth_noise((400, 400), extent, rng)
    assert abs(field.mean()) < 0.1
    assert abs(field.std() - 1) < 0.1
    far = round(4 * extent)
    assert np.corrcoef(field[:, :-1].ravel(), field[:, 1:].ravel())[0, 1] > 0.8
    assert abs(np.corrcoef(field[:, :-far].ravel(), field[:, far:].ravel())[0, 1]) < 0.1


@settings(max_examples=10)
@given(st.integers(1, 5), st.integers(0, 2**32))
def test_lines_are_thin_and_lie_between_0_and_1(count, seed):
    lines = draw_lines((150, 130), count, np.random.default_rng(seed))
    assert lines.min() == 0
    assert 0 < lines.max() <= 1
    assert (lines > 0.2).mean() < 0.05 * count
    assert not draw_lines((30, 20), 0, np.random.default_rng(seed)).any()


@settings(max_examples=15)
@given(st.integers(60, 300), st.integers(60, 300), st.integers(0, 2**32))
def test_cards_of_any_size_have_ink_from_0_to_1_mostly_near_their_borders(rows, columns, seed):
    ink = draw_card((rows, columns), np.random.default_rng(seed))
    assert (ink.shape, ink.dtype) == ((rows, columns), np.float32)
    assert 0 <= ink.min() <= ink.max() <= 1
    assert (ink > 0.5).mean() < 0.25

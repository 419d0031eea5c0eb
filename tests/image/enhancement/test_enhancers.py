"""The blend carries enhanced ridges into the gaps of the image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import correlation, plane_wave

from fpmatch.image.enhancement.enhancers import ENHANCED_SHARE, MAX_AMPLITUDE, blend

WAVE = plane_wave(30, 9)
NOTHING = np.zeros_like(WAVE)
WHOLE = np.ones(WAVE.shape, bool)
FLOATS = arrays(np.float32, (20, 24), elements=st.floats(-3, 3, width=32))


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (48, 60)])
def test_nothing_blends_to_nothing(shape):
    nothing = np.zeros(shape, np.float32)
    assert not blend(nothing, nothing, np.ones(shape, bool)).any()


@pytest.mark.parametrize("scale", [0.5, 1, 20])
def test_the_amplitude_of_the_enhanced_image_does_not_matter_unless_it_is_tiny(scale):
    inside = np.s_[16:80, 16:80]
    out = blend(NOTHING, np.float32(scale) * WAVE, WHOLE)
    assert correlation(out[inside], WAVE[inside]) > 0.99
    assert out[inside].std() == pytest.approx(ENHANCED_SHARE, abs=0.08)
    assert np.abs(blend(NOTHING, np.float32(1e-4) * WAVE, WHOLE)).max() < 0.01


def test_a_gap_in_the_image_is_filled():
    torn = WAVE.copy()
    torn[40:56, 40:56] = 0
    out = blend(torn, WAVE, WHOLE)
    assert correlation(out[42:54, 42:54], WAVE[42:54, 42:54]) > 0.99


@given(FLOATS, FLOATS, arrays(np.bool_, (20, 24)))
def test_the_blend_lies_between_its_bounds_and_in_the_mask(pixels, enhanced, mask):
    out = blend(pixels, enhanced, mask)
    assert out.dtype == np.float32
    assert not out[~mask].any()
    bound = (1 - ENHANCED_SHARE) * np.abs(pixels) + ENHANCED_SHARE * MAX_AMPLITUDE
    assert (np.abs(out) <= bound + 1e-4).all()

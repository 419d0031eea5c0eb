"""The enhanced ridges carried into the gaps of the image."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import plane_wave

from fpmatch.image.enhancement.blend import BlendParameters, blend

WAVE = plane_wave(30, 9)
WHOLE = np.ones(WAVE.shape, bool)
INSIDE = (slice(16, 80), slice(16, 80))


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (48, 60)])
def test_nothing_blends_to_nothing(shape: tuple[int, int]) -> None:
    nothing = np.zeros(shape, np.float32)
    assert not blend(nothing, nothing, np.ones(shape, bool)).any()


def test_outside_the_mask_is_zero() -> None:
    mask = WHOLE.copy()
    mask[:, 40:] = False
    out = blend(WAVE, WAVE, mask)
    assert not out[:, 40:].any()
    assert out[:, :40].any()
    assert not blend(WAVE, WAVE, ~WHOLE).any()


@pytest.mark.parametrize("scale", [0.5, 1, 20])
def test_the_amplitude_of_the_enhanced_image_does_not_matter(scale: float) -> None:
    p = BlendParameters(enhanced_share=1.0)
    out = blend(np.zeros_like(WAVE), np.float32(scale) * WAVE, WHOLE, p)
    assert correlation(out[INSIDE], WAVE[INSIDE]) > 0.99
    assert out[INSIDE].std() == pytest.approx(1, abs=0.15)


def test_the_share_goes_from_the_image_to_the_enhanced_one() -> None:
    other = plane_wave(120, 9)
    image_only = blend(WAVE, other, WHOLE, BlendParameters(enhanced_share=0.0))
    assert image_only == pytest.approx(WAVE, abs=1e-6)
    enhanced_only = blend(WAVE, other, WHOLE, BlendParameters(enhanced_share=1.0))
    assert correlation(enhanced_only[INSIDE], other[INSIDE]) > 0.99
    assert abs(correlation(enhanced_only[INSIDE], WAVE[INSIDE])) < 0.05


def test_a_gap_in_the_image_is_filled() -> None:
    torn = WAVE.copy()
    torn[40:56, 40:56] = 0
    out = blend(torn, WAVE, WHOLE, BlendParameters(enhanced_share=0.5))
    assert correlation(out[42:54, 42:54], WAVE[42:54, 42:54]) > 0.99


def test_next_to_nothing_is_not_blown_up() -> None:
    p = BlendParameters(enhanced_share=1.0, min_amplitude=0.05)
    out = blend(np.zeros_like(WAVE), np.float32(1e-4) * WAVE, WHOLE, p)
    assert np.abs(out).max() < 0.01


@given(
    arrays(np.float32, (20, 24), elements=st.floats(-3, 3, width=32)),
    arrays(np.float32, (20, 24), elements=st.floats(-3, 3, width=32)),
    st.floats(0, 1),
)
def test_the_blend_lies_between_its_bounds(
    pixels: np.ndarray, enhanced: np.ndarray, share: float
) -> None:
    p = BlendParameters(enhanced_share=share)
    out = blend(pixels, enhanced, np.ones(pixels.shape, bool), p)
    assert out.dtype == np.float32
    assert (np.abs(out) <= (1 - share) * np.abs(pixels) + share * p.clip + 1e-4).all()

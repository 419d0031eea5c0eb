import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.image.enhancement.enhancers import smoothed_orientation
from fpmatch.image.enhancement.gabor import (
    FILTER_ANGLES,
    FILTER_PERIODS_PX,
    RADIUS_PX,
    doubled_angles,
    filter_bank,
    gabor_filter,
    ridge_period,
)
from fpmatch.image.preprocess.arrays import BLOCK_PX
from fpmatch.image.preprocess.spectrum import PERIODS_PX, ridge_spectrum
from tests.image.made_images import plane_wave

INSIDE = (slice(20, -20), slice(20, -20))


def constant(shape, value):
    return np.full(shape, value, np.float32)


def enhanced(pixels, angle_deg, period):
    """Enhance with one orientation and period everywhere."""
    shape = pixels.shape
    angle = constant(shape, np.radians(angle_deg))
    return gabor_filter(pixels, np.ones(shape, bool), angle, constant(shape, period))


@pytest.mark.parametrize("period", FILTER_PERIODS_PX[1:-1:2])
@pytest.mark.parametrize("angle", np.arange(0, 180, 22.5))
def test_a_wave_passes_its_own_filter_and_no_other(angle, period):
    wave = plane_wave(angle, period)
    assert enhanced(wave, angle, period)[INSIDE] == pytest.approx(wave[INSIDE], abs=0.05)
    assert np.abs(enhanced(plane_wave(angle + 90, 9), angle, 9)[INSIDE]).max() < 0.1
    assert np.abs(enhanced(constant((80, 80), 3.0), angle, period)[INSIDE]).max() < 1e-3


@pytest.mark.parametrize(
    ("angle", "period", "same_angle", "same_period"),
    [
        (179.99, 9, 0, 9),
        (30, 0.1, 30, FILTER_PERIODS_PX[0]),
        (30, 1000, 30, FILTER_PERIODS_PX[-1]),
        (30, np.nan, 30, FILTER_PERIODS_PX[-1]),
    ],
)
def test_at_the_ends_of_the_bank(angle, period, same_angle, same_period, rng):
    pixels = rng.normal(0, 1, (40, 40)).astype(np.float32)
    expected = enhanced(pixels, same_angle, same_period)
    assert np.array_equal(enhanced(pixels, angle, period), expected)


def test_outside_the_mask_is_zero_and_inside_does_not_depend_on_it(rng):
    pixels = rng.normal(0, 1, (60, 70)).astype(np.float32)
    angle, period = constant((60, 70), 1.0), constant((60, 70), 8.0)
    mask = rng.random((60, 70)) < 0.3
    out = gabor_filter(pixels, mask, angle, period)
    assert not out[~mask].any()
    whole = gabor_filter(pixels, np.ones_like(mask), angle, period)
    assert out[mask] == pytest.approx(whole[mask], abs=1e-5)
    assert not gabor_filter(pixels, np.zeros_like(mask), angle, period).any()


def test_each_filter_of_the_bank_ignores_brightness():
    bank = filter_bank()
    side = 2 * RADIUS_PX + 1
    assert bank.shape == (FILTER_ANGLES * len(FILTER_PERIODS_PX), side, side)
    assert np.abs(bank.sum(axis=(1, 2))).max() < 1e-5
    assert bank[:, ::-1, ::-1] == pytest.approx(bank, abs=1e-6)


SHORTEST, LONGEST = PERIODS_PX[[0, -1]]


def period_of(pixels, mask=None):
    spectrum = ridge_spectrum(pixels)
    whole = np.ones(spectrum.total.shape, bool) if mask is None else mask
    field = smoothed_orientation(doubled_angles(spectrum, whole))
    return ridge_period(spectrum, field, whole)


@given(st.floats(0, 180), st.floats(6, 13), st.floats(0, 7))
def test_a_plane_wave_has_its_period_everywhere(angle, period, phase):
    found = period_of(plane_wave(angle, period, phase=phase))
    assert found[3:-3, 3:-3] == pytest.approx(period, rel=0.1)


def test_a_period_that_grows_across_the_image_is_followed():
    x = np.arange(300)
    local = 7 + 5 * x / 300
    wave = np.cos(2 * np.pi * np.cumsum(1 / local)).astype(np.float32)
    found = period_of(np.tile(wave, (80, 1)))[5]
    centre = (np.arange(found.size) + 0.5) * BLOCK_PX
    assert found[4:-4] == pytest.approx(np.interp(centre[4:-4], x, local), rel=0.1)


def test_what_lies_outside_the_mask_does_not_influence_what_is_inside():
    pixels = plane_wave(90, 9, (96, 192))
    other = pixels.copy()
    other[:, 130:] = 5 * plane_wave(90, 6, (96, 62))
    mask = np.zeros((12, 24), bool)
    mask[:, :13] = True
    assert np.array_equal(period_of(pixels, mask)[:, :13], period_of(other, mask)[:, :13])


@given(arrays(np.float32, (40, 50), elements=st.floats(-3, 3, width=32)))
def test_any_pixels_give_a_period_that_the_spectrum_samples(pixels):
    found = period_of(pixels)
    assert found.dtype == np.float32
    assert (found >= SHORTEST * 0.999).all()
    assert (found <= LONGEST * 1.001).all()

"""The distance that the ridges have, everywhere in the mask."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import along_and_across, concentric_rings, plane_wave

from fpmatch.image.enhancement.enhancers import smoothed_orientation
from fpmatch.image.enhancement.gabor import doubled_angles, ridge_period
from fpmatch.image.preprocess.arrays import BLOCK_PX, blocks_to_pixels
from fpmatch.image.preprocess.spectrum import PERIODS_PX, ridge_spectrum

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


@pytest.mark.parametrize("period", [7, 9, 11])
def test_rings_have_one_period_away_from_their_centre(period):
    shape = (200, 200)
    found = blocks_to_pixels(period_of(concentric_rings(shape, period)), shape)
    radius = np.hypot(*along_and_across(shape, 0))
    assert found[(radius > 40) & (radius < 85)] == pytest.approx(period, rel=0.12)


def test_a_period_that_grows_across_the_image_is_followed():
    x = np.arange(300)
    local = 7 + 5 * x / 300
    wave = np.cos(2 * np.pi * np.cumsum(1 / local)).astype(np.float32)
    found = period_of(np.tile(wave, (80, 1)))[5]
    centre = (np.arange(found.size) + 0.5) * BLOCK_PX
    assert found[4:-4] == pytest.approx(np.interp(centre[4:-4], x, local), rel=0.1)


def test_noisy_and_sharp_ridges_keep_their_period(rng):
    noisy = plane_wave(30, 9) + rng.normal(0, 0.8, (96, 96)).astype(np.float32)
    assert period_of(noisy)[3:-3, 3:-3] == pytest.approx(9, rel=0.12)
    square = np.sign(plane_wave(90, 12)).astype(np.float32)
    assert period_of(square)[3:-3, 3:-3] == pytest.approx(12, rel=0.1)


def test_what_lies_outside_the_mask_does_not_influence_what_is_inside():
    pixels = plane_wave(90, 9, (96, 192))
    other = pixels.copy()
    other[:, 130:] = 5 * plane_wave(90, 6, (96, 62))
    mask = np.zeros((12, 24), bool)
    mask[:, :13] = True
    assert np.array_equal(period_of(pixels, mask)[:, :13], period_of(other, mask)[:, :13])


@pytest.mark.parametrize("filled", [False, True])
def test_without_ridges_the_period_is_a_usual_one(filled):
    found = period_of(np.zeros((60, 70), np.float32), np.full((8, 9), filled))
    assert found == pytest.approx(np.sqrt(SHORTEST * LONGEST), rel=0.05)


@given(arrays(np.float32, (40, 50), elements=st.floats(-3, 3, width=32)))
def test_any_pixels_give_a_period_that_the_spectrum_samples(pixels):
    found = period_of(pixels)
    assert found.dtype == np.float32
    assert (found >= SHORTEST * 0.999).all()
    assert (found <= LONGEST * 1.001).all()

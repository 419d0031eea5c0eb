"""The angle that the ridges have, everywhere in the mask."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import along_and_across, concentric_rings, plane_wave, turn_between

from fpmatch.image.enhancement.enhancers import (
    enhanced_orientation,
    orientation_at_pixels,
    smoothed_orientation,
)
from fpmatch.image.enhancement.gabor import doubled_angles
from fpmatch.image.preprocess.spectrum import ridge_spectrum


def whole(pixels):
    return np.ones([-(-side // 8) for side in pixels.shape], bool)


def field_of(pixels, mask=None):
    blocks = whole(pixels) if mask is None else mask
    return smoothed_orientation(doubled_angles(ridge_spectrum(pixels), blocks))


def enhanced_field_of(pixels, mask=None):
    return enhanced_orientation(pixels, whole(pixels) if mask is None else mask)


both_methods = pytest.mark.parametrize("field", [field_of, enhanced_field_of])


def error_deg(orientation, true_deg):
    return turn_between(np.degrees(orientation), true_deg, period_deg=180)


@both_methods
@pytest.mark.parametrize("period", [5.5, 9, 14])
@pytest.mark.parametrize("angle", np.arange(0, 180, 11.25))
def test_a_plane_wave_has_its_angle_everywhere(field, angle, period):
    wave = plane_wave(angle, period)
    found = field(wave)
    assert error_deg(found.orientation[3:-3, 3:-3], angle).max() < 2
    assert error_deg(orientation_at_pixels(found.orientation, wave.shape)[24:-24], angle).max() < 6
    assert found.coherence[3:-3, 3:-3].min() > 0.8


@both_methods
@pytest.mark.parametrize("period", [6, 9, 12])
def test_rings_run_around_their_centre(field, period):
    shape = (200, 240)
    found = orientation_at_pixels(field(concentric_rings(shape, period)).orientation, shape)
    along, across = along_and_across(shape, 0)
    radius = np.hypot(along, across)
    ring = (radius > 35) & (radius < 85)
    error = error_deg(found, np.degrees(np.arctan2(-across, along)) + 90)[ring]
    assert error.max() < 6
    assert error.mean() < 2


def test_noise_is_less_coherent_than_ridges_which_keep_their_angle_under_it(rng):
    noise = rng.normal(0, 1, (96, 96)).astype(np.float32)
    ridges = field_of(plane_wave(40, 9))
    assert field_of(noise).coherence.mean() < 0.5 * ridges.coherence[2:-2, 2:-2].mean()
    found = field_of(plane_wave(70, 9) + noise)
    assert error_deg(found.orientation[3:-3, 3:-3], 70).max() < 10


@both_methods
def test_ridges_outside_the_mask_do_not_influence_those_inside(field):
    pixels = plane_wave(20, 9, (96, 192))
    other = pixels.copy()
    other[:, 130:] = 5 * plane_wave(110, 7, (96, 62))
    mask = np.zeros((12, 24), bool)
    mask[:, :13] = True
    one, two = field(pixels, mask), field(other, mask)
    assert np.array_equal(one.orientation[:, :13], two.orientation[:, :13])
    assert np.array_equal(one.coherence[:, :13], two.coherence[:, :13])
    assert error_deg(one.orientation[2:-2, 2:13], 20).max() < 2


@pytest.mark.parametrize("filled", [False, True])
def test_without_ridges_all_is_finite_and_nothing_coherent(filled):
    field = field_of(np.zeros((60, 70), np.float32), np.full((8, 9), filled))
    assert np.isfinite(field.orientation).all()
    assert not field.coherence.any()


def test_between_two_blocks_the_angle_goes_the_short_way():
    orientation = np.radians([[175.0, 175.0, 5.0, 5.0]]).astype(np.float32)
    row = np.degrees(orientation_at_pixels(orientation, (8, 32))[4])
    assert error_deg(np.radians(row), 0).max() <= 5.01
    assert (np.diff((row + 90) % 180) >= -1e-3).all()
    almost_pi = np.full((2, 2), np.nextafter(np.float32(np.pi), np.float32(0)))
    assert error_deg(orientation_at_pixels(almost_pi, (16, 16)), 0).max() < 0.01


@both_methods
@given(
    pixels=st.tuples(st.integers(1, 40), st.integers(1, 50)).flatmap(
        lambda shape: arrays(np.float32, shape, elements=st.floats(-3, 3, width=32))
    ),
    half=st.booleans(),
)
def test_any_pixels_give_angles_below_pi(field, pixels, half):
    mask = whole(pixels)
    mask[:, : mask.shape[1] // 2] = not half
    found = field(pixels, mask)
    assert found.orientation.shape == mask.shape
    for angles in (found.orientation, orientation_at_pixels(found.orientation, pixels.shape)):
        assert ((angles >= 0) & (angles < np.float32(np.pi))).all()
    assert ((found.coherence >= 0) & (found.coherence <= 1.0001)).all()

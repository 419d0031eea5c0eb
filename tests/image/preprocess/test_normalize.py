import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.image.preprocess.normalize import (
    CLIP,
    WINDOW_SIGMA_PX,
    _blurred,
    _mean,
    _smoothed,
    normalize,
)
from tests.image.made_images import as_picture, correlation, plane_wave


@pytest.mark.parametrize(("low", "high"), [(0, 255), (10, 60), (200, 255), (120, 150)], ids=str)
def test_ridges_are_positive_with_unit_contrast_whatever_the_light(low, high):
    wave = plane_wave(30, 9)
    image = normalize(np.rint(low + (high - low) * (1 - wave) / 2).astype(np.uint8))
    middle = (slice(24, 72), slice(24, 72))
    assert image.valid.all()
    assert correlation(image.pixels[middle], wave[middle]) > 0.98
    assert abs(image.pixels[middle].mean()) < 0.05
    assert image.pixels[middle].std() == pytest.approx(1, abs=0.1)
    assert image.contrast[middle].mean() == pytest.approx((high - low) / np.sqrt(8), rel=0.1)


def test_a_grainy_image_and_a_large_print_are_smoothed_and_others_are_not(rng):
    wave = plane_wave(30, 9, (160, 160))
    for noise, smoothed in ((4.0, False), (60.0, True)):
        grey = (128 - 60 * wave + rng.normal(0, noise, wave.shape)).clip(0, 255).astype(np.uint8)
        made = _smoothed(grey)
        assert (made is not grey) == smoothed
        if smoothed:
            assert correlation(made, -wave) > correlation(grey, -wave) + 0.05
            assert np.array_equal(normalize(made).pixels, normalize(grey).pixels)
    large = as_picture(plane_wave(30, 9, (434, 434)))  # 400 mm2 are 155,000 pixels
    small = large.copy()
    small[:, 217:] = 255
    assert _smoothed(large) is not large
    assert _smoothed(small) is small


def test_white_paper_is_invalid_and_ridges_beside_it_keep_their_contrast():
    ridges = as_picture(plane_wave(90, 9, (100, 100)))
    image = normalize(np.pad(ridges, 40, constant_values=255))
    assert not image.valid[:30].any()
    assert image.valid[60:120, 60:120].all()
    inside = image.pixels[40:140, 40:140]
    assert inside[40:60, 10:25].std() > 0.8
    assert np.abs(inside - normalize(ridges).pixels)[40:60, 10:90].mean() < 0.2
    assert not any(array.any() for array in normalize(np.full((64, 80), 130, np.uint8)))


@pytest.mark.parametrize("spot", [np.s_[40:80, 40:80], np.s_[:8, 50:58]])
def test_flat_spots_inside_the_print_and_small_ones_at_the_border_stay_valid(spot):
    image = as_picture(plane_wave(90, 9, (120, 120)))
    image[spot] = 255
    assert normalize(image).valid.all()


@settings(max_examples=25)
@given(arrays(np.uint8, st.tuples(st.integers(1, 60), st.integers(1, 60))))
def test_any_image_gives_finite_pixels_within_the_clip(picture):
    image = normalize(picture)
    assert {array.shape for array in image} == {picture.shape}
    assert np.abs(image.pixels).max() <= CLIP
    assert (image.contrast >= 0).all()
    assert not image.pixels[~image.valid].any()


@pytest.mark.parametrize("shape", [(64, 64), (97, 131), (5, 90), (240, 161)])
def test_the_mean_on_a_small_image_is_the_blur_of_what_is_not_left_out(shape):
    noise = np.random.default_rng(4).random(shape).astype(np.float32)
    expected = cv2.GaussianBlur(noise, (0, 0), WINDOW_SIGMA_PX, borderType=cv2.BORDER_REFLECT)
    error = np.abs(_mean(noise, _blurred(np.ones(shape, np.float32))) - expected)
    assert error.max() < 0.04
    assert error.mean() < 0.007
    shown = (np.arange(shape[1]) > shape[1] // 2) * np.ones(shape, np.float32)
    mean = _mean(100 * shown, _blurred(shown) + np.float32(1e-6))
    assert mean[shown > 0] == pytest.approx(100, rel=1e-5)

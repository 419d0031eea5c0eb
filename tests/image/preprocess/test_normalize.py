"""Every neighbourhood alike, and nothing where nothing was recorded."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import Grey, as_picture, hostile_pictures, plane_wave

from fpmatch.image.preprocess.normalize import NormalizationParameters, _Blur, normalize

CLIP = NormalizationParameters().clip
FLAT = ["black", "white", "grey"]


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


@pytest.mark.parametrize("name", FLAT)
def test_a_flat_picture_has_nothing_valid(name: str) -> None:
    image = normalize(hostile_pictures()[name])
    assert not image.valid.any()
    assert not image.pixels.any()
    assert not image.contrast.any()


@pytest.mark.parametrize(("low", "high"), [(0, 255), (10, 60), (200, 255), (120, 150)], ids=str)
def test_ridges_are_positive_with_unit_contrast_whatever_the_light(low: int, high: int) -> None:
    wave = plane_wave(30, 9)
    picture = np.rint(low + (high - low) * (1 - wave) / 2).astype(np.uint8)
    image = normalize(picture)
    middle = (slice(24, 72), slice(24, 72))
    assert image.valid.all()
    assert correlation(image.pixels[middle], wave[middle]) > 0.98
    assert abs(image.pixels[middle].mean()) < 0.05
    assert image.pixels[middle].std() == pytest.approx(1, abs=0.1)
    assert image.contrast[middle].mean() == pytest.approx((high - low) / np.sqrt(8), rel=0.1)


def test_a_shadow_across_the_print_is_taken_out() -> None:
    wave = plane_wave(90, 9, (120, 120))
    shade = np.linspace(0.3, 1.0, 120)[:, None]
    image = normalize(np.rint(shade * (128 - 100 * wave)).astype(np.uint8))
    assert correlation(image.pixels[20:40], wave[20:40]) > 0.97
    assert correlation(image.pixels[80:100], wave[80:100]) > 0.97
    rows = image.pixels.std(axis=1)
    assert rows[20:100].min() > 0.85 * rows[20:100].max()


def test_noise_of_a_few_grey_levels_is_not_blown_up() -> None:
    faint = np.random.default_rng(0).normal(128, 1.5, (80, 80)).round().astype(np.uint8)
    image = normalize(faint)
    assert image.pixels.std() < 0.5


def test_white_paper_is_invalid_and_ridges_beside_it_keep_their_contrast() -> None:
    wave = plane_wave(90, 9, (100, 100))
    framed = np.pad(as_picture(wave), 40, constant_values=255)
    image = normalize(framed)
    assert not image.valid[:30].any()
    assert image.valid[60:120, 60:120].all()
    inside = image.pixels[40:140, 40:140]
    assert inside[40:60, 10:25].std() > 0.8
    assert (
        np.abs(inside[40:60, 10:90] - normalize(as_picture(wave)).pixels[40:60, 10:90]).mean() < 0.2
    )


@pytest.mark.parametrize("spot", [np.s_[40:80, 40:80], np.s_[:8, 50:58]])
def test_flat_spots_inside_the_print_and_small_ones_at_the_border_stay_valid(
    spot: tuple[slice, slice],
) -> None:
    image = as_picture(plane_wave(90, 9, (120, 120)))
    image[spot] = 255
    assert normalize(image).valid.all()


def test_the_parameters_reach_the_computation() -> None:
    picture = as_picture(plane_wave(90, 9))
    assert np.abs(normalize(picture, NormalizationParameters(clip=0.5)).pixels).max() == 0.5


@settings(max_examples=25)
@given(arrays(np.uint8, st.tuples(st.integers(1, 60), st.integers(1, 60))))
def test_any_image_gives_finite_pixels_within_the_clip(picture: Grey) -> None:
    image = normalize(picture)
    assert image.pixels.shape == image.contrast.shape == image.valid.shape == picture.shape
    assert np.abs(image.pixels).max() <= CLIP
    assert (image.contrast >= 0).all()
    assert not image.pixels[~image.valid].any()


@pytest.mark.parametrize("shape", [(64, 64), (97, 131), (5, 90), (240, 161)])
@pytest.mark.parametrize("sigma", [1.0, 3.0, 8.0, 12.0, 20.0])
def test_the_mean_on_a_small_image_is_the_blur(shape: tuple[int, int], sigma: float) -> None:
    noise = np.random.default_rng(4).random(shape).astype(np.float32)
    expected = cv2.GaussianBlur(noise, (0, 0), sigma, borderType=cv2.BORDER_REFLECT)
    mean = _Blur(np.ones(shape, np.float32), sigma).mean(noise)
    assert np.abs(mean - expected).max() < 0.04
    assert np.abs(mean - expected).mean() < 0.007


def test_the_mean_is_taken_over_what_is_not_left_out() -> None:
    image = np.full((75, 42), 100, np.float32)
    image[:40] = 0
    mean = _Blur((image > 0).astype(np.float32), 12.0).mean(image)
    assert mean[40:] == pytest.approx(image[40:], rel=1e-5)

"""The angle that the ridges have, everywhere in the mask."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import along_and_across, concentric_rings, plane_wave, turn_between

from fpmatch.image.enhancement.orientation import (
    OrientationField,
    enhanced_orientation,
    orientation_at_pixels,
    ridge_orientation,
)
from fpmatch.image.enhancement.spectrum import RidgeSpectrum, SpectrumParameters, ridge_spectrum
from fpmatch.image.preprocess.blocks import Blocks

EIGHT = SpectrumParameters(step_px=8)


def field_of(pixels: np.ndarray) -> tuple[OrientationField, RidgeSpectrum]:
    spectrum = ridge_spectrum(pixels)
    field = ridge_orientation(spectrum, np.ones(spectrum.total.shape, bool))
    return field, spectrum


def error_deg(orientation: np.ndarray, true_deg: object) -> np.ndarray:
    return turn_between(np.degrees(orientation), true_deg, period_deg=180)


@pytest.mark.parametrize("period", [5.5, 9, 14])
@pytest.mark.parametrize("angle", np.arange(0, 180, 11.25))
def test_a_plane_wave_has_its_angle_everywhere(angle: float, period: float) -> None:
    field, spectrum = field_of(plane_wave(angle, period))
    assert error_deg(field.orientation[3:-3, 3:-3], angle).max() < 2
    assert error_deg(orientation_at_pixels(field.orientation, spectrum)[24:-24], angle).max() < 6
    assert field.coherence[3:-3, 3:-3].min() > 0.8


@given(st.floats(0, 180), st.floats(5.5, 14), st.floats(0, 7))
def test_any_plane_wave_has_its_angle(angle: float, period: float, phase: float) -> None:
    field, _ = field_of(plane_wave(angle, period, (64, 64), phase))
    assert error_deg(field.orientation[3:5, 3:5], angle).max() < 3


@pytest.mark.parametrize("period", [6, 9, 12])
def test_rings_run_around_their_centre(period: float) -> None:
    shape = (200, 240)
    field, spectrum = field_of(concentric_rings(shape, period))
    found = orientation_at_pixels(field.orientation, spectrum)
    along, across = along_and_across(shape, 0)
    around = np.degrees(np.arctan2(-across, along)) + 90
    radius = np.hypot(along, across)
    ring = (radius > 35) & (radius < 85)
    assert error_deg(found, around)[ring].max() < 6
    assert error_deg(found, around)[ring].mean() < 2


def test_noise_is_less_coherent_than_ridges(rng: np.random.Generator) -> None:
    noise, _ = field_of(rng.normal(0, 1, (96, 96)).astype(np.float32))
    ridges, _ = field_of(plane_wave(40, 9))
    assert noise.coherence.mean() < 0.5 * ridges.coherence[2:-2, 2:-2].mean()


def test_ridges_under_noise_keep_their_angle(rng: np.random.Generator) -> None:
    field, _ = field_of(plane_wave(70, 9) + rng.normal(0, 1, (96, 96)).astype(np.float32))
    assert error_deg(field.orientation[3:-3, 3:-3], 70).max() < 10


def test_what_lies_outside_the_mask_does_not_influence_what_is_inside() -> None:
    pixels = plane_wave(20, 9, (96, 192))
    other = pixels.copy()
    other[:, 130:] = 5 * plane_wave(110, 7, (96, 62))
    mask = np.zeros((12, 24), bool)
    mask[:, :13] = True
    one = ridge_orientation(ridge_spectrum(pixels, EIGHT), mask)
    two = ridge_orientation(ridge_spectrum(other, EIGHT), mask)
    assert np.array_equal(one.orientation[:, :13], two.orientation[:, :13])
    assert np.array_equal(one.coherence[:, :13], two.coherence[:, :13])
    assert error_deg(one.orientation[2:-2, 2:13], 20).max() < 2


@pytest.mark.parametrize("filled", [False, True])
def test_without_ridges_all_is_finite_and_nothing_coherent(filled: bool) -> None:
    spectrum = ridge_spectrum(np.zeros((60, 70), np.float32))
    field = ridge_orientation(spectrum, np.full(spectrum.total.shape, filled))
    assert np.isfinite(field.orientation).all()
    assert not field.coherence.any()


def test_between_two_cells_the_angle_goes_the_short_way() -> None:
    spectrum = ridge_spectrum(np.zeros((8, 32), np.float32), EIGHT)
    orientation = np.radians([[175.0, 175.0, 5.0, 5.0]]).astype(np.float32)
    row = np.degrees(orientation_at_pixels(orientation, spectrum)[4])
    assert error_deg(np.radians(row), 0).max() <= 5.01
    assert (np.diff((row + 90) % 180) >= -1e-3).all()


def test_an_orientation_of_pi_is_none() -> None:
    spectrum = ridge_spectrum(np.zeros((16, 16), np.float32), EIGHT)
    almost = np.full((2, 2), np.nextafter(np.float32(np.pi), np.float32(0)))
    found = orientation_at_pixels(almost, spectrum)
    assert error_deg(found, 0).max() < 0.01


@given(arrays(np.float32, (40, 50), elements=st.floats(-3, 3, width=32)), st.booleans())
def test_any_pixels_give_angles_below_pi(pixels: np.ndarray, half: bool) -> None:
    spectrum = ridge_spectrum(pixels)
    mask = np.ones(spectrum.total.shape, bool)
    mask[:, : mask.shape[1] // 2] = not half
    field = ridge_orientation(spectrum, mask)
    assert (field.orientation >= 0).all()
    assert (field.orientation < np.float32(np.pi)).all()
    assert (field.coherence >= 0).all()
    assert (field.coherence <= 1.0001).all()
    at_pixels = orientation_at_pixels(field.orientation, spectrum)
    assert (at_pixels >= 0).all()
    assert (at_pixels < np.float32(np.pi)).all()


# --- the same, on an enhanced image


def on_cells(shape: tuple[int, int]) -> tuple[Blocks, np.ndarray]:
    """Return blocks of 8 pixels, and a mask of them that leaves nothing out."""
    return Blocks(8, shape), np.ones((-(-shape[0] // 8), -(-shape[1] // 8)), bool)


@pytest.mark.parametrize("period", [5.5, 9, 14])
@pytest.mark.parametrize("angle", np.arange(0, 180, 11.25))
def test_enhanced_ridges_have_the_angle_that_their_spectrum_has(
    angle: float, period: float
) -> None:
    wave = plane_wave(angle, period)
    grid, mask = on_cells(wave.shape)
    found = enhanced_orientation(wave, mask, grid)
    spectrum = ridge_spectrum(wave, EIGHT)
    other = ridge_orientation(spectrum, np.ones(spectrum.total.shape, bool))
    inside = np.s_[2:-2, 2:-2]
    assert error_deg(found.orientation[inside], angle).max() < 2
    assert error_deg(found.orientation[inside], np.degrees(other.orientation[inside])).max() < 3
    assert found.coherence[inside].min() > 0.8


@pytest.mark.parametrize("period", [6, 9, 12])
def test_enhanced_rings_run_around_their_centre(period: float) -> None:
    shape = (200, 240)
    grid, mask = on_cells(shape)
    field = enhanced_orientation(concentric_rings(shape, period), mask, grid)
    found = orientation_at_pixels(field.orientation, grid)
    along, across = along_and_across(shape, 0)
    around = np.degrees(np.arctan2(-across, along)) + 90
    radius = np.hypot(along, across)
    ring = (radius > 35) & (radius < 85)
    assert error_deg(found, around)[ring].max() < 6
    assert error_deg(found, around)[ring].mean() < 2


def test_enhanced_ridges_outside_the_mask_do_not_influence_those_inside() -> None:
    one = plane_wave(20, 9, (96, 192))
    other = one.copy()
    other[:, 130:] = 5 * plane_wave(110, 7, (96, 62))
    grid, mask = on_cells(one.shape)
    mask[:, 16:] = False
    first, second = (enhanced_orientation(pixels, mask, grid) for pixels in (one, other))
    assert np.array_equal(first.orientation[:, :16], second.orientation[:, :16])
    assert np.array_equal(first.coherence[:, :16], second.coherence[:, :16])


@given(
    st.tuples(st.integers(1, 40), st.integers(1, 40)).flatmap(
        lambda shape: arrays(np.float32, shape, elements=st.floats(-1, 1, width=32))
    )
)
def test_any_enhanced_image_gives_angles_below_pi(pixels: np.ndarray) -> None:
    grid, mask = on_cells(pixels.shape)
    field = enhanced_orientation(pixels, mask, grid)
    assert field.orientation.shape == mask.shape
    assert (field.orientation >= 0).all()
    assert (field.orientation < np.float32(np.pi)).all()
    assert (field.coherence >= 0).all()
    assert (field.coherence <= 1.0001).all()

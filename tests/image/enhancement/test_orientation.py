"""The angle that the ridges have, everywhere in the mask."""

from __future__ import annotations

from collections.abc import Callable

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
from fpmatch.image.preprocess.blocks import BlockGrid, Blocks

EIGHT = SpectrumParameters(step_px=8)
Field = Callable[..., tuple[OrientationField, BlockGrid]]


def field_of(
    pixels: np.ndarray, mask: np.ndarray | None = None
) -> tuple[OrientationField, RidgeSpectrum]:
    spectrum = ridge_spectrum(pixels, EIGHT)
    whole = np.ones(spectrum.total.shape, bool)
    return ridge_orientation(spectrum, whole if mask is None else mask), spectrum


def enhanced_field_of(
    pixels: np.ndarray, mask: np.ndarray | None = None
) -> tuple[OrientationField, Blocks]:
    grid = Blocks(8, (pixels.shape[0], pixels.shape[1]))
    whole = np.ones((-(-grid.shape[0] // 8), -(-grid.shape[1] // 8)), bool)
    return enhanced_orientation(pixels, whole if mask is None else mask, grid), grid


both_methods = pytest.mark.parametrize("field", [field_of, enhanced_field_of])


def error_deg(orientation: np.ndarray, true_deg: object) -> np.ndarray:
    return turn_between(np.degrees(orientation), true_deg, period_deg=180)


@both_methods
@pytest.mark.parametrize("period", [5.5, 9, 14])
@pytest.mark.parametrize("angle", np.arange(0, 180, 11.25))
def test_a_plane_wave_has_its_angle_everywhere(field: Field, angle: float, period: float) -> None:
    found, grid = field(plane_wave(angle, period))
    assert error_deg(found.orientation[3:-3, 3:-3], angle).max() < 2
    assert error_deg(orientation_at_pixels(found.orientation, grid)[24:-24], angle).max() < 6
    assert found.coherence[3:-3, 3:-3].min() > 0.8


@both_methods
@pytest.mark.parametrize("period", [6, 9, 12])
def test_rings_run_around_their_centre(field: Field, period: float) -> None:
    shape = (200, 240)
    measured, grid = field(concentric_rings(shape, period))
    found = orientation_at_pixels(measured.orientation, grid)
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


@both_methods
def test_ridges_outside_the_mask_do_not_influence_those_inside(field: Field) -> None:
    pixels = plane_wave(20, 9, (96, 192))
    other = pixels.copy()
    other[:, 130:] = 5 * plane_wave(110, 7, (96, 62))
    mask = np.zeros((12, 24), bool)
    mask[:, :13] = True
    (one, _), (two, _) = field(pixels, mask), field(other, mask)
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


@both_methods
@given(
    pixels=st.tuples(st.integers(1, 40), st.integers(1, 50)).flatmap(
        lambda shape: arrays(np.float32, shape, elements=st.floats(-3, 3, width=32))
    ),
    half=st.booleans(),
)
def test_any_pixels_give_angles_below_pi(field: Field, pixels: np.ndarray, half: bool) -> None:
    mask = np.ones([-(-side // 8) for side in pixels.shape], bool)
    mask[:, : mask.shape[1] // 2] = not half
    found, grid = field(pixels, mask)
    assert found.orientation.shape == mask.shape
    at_pixels = orientation_at_pixels(found.orientation, grid)
    for angles in (found.orientation, at_pixels):
        assert (angles >= 0).all()
        assert (angles < np.float32(np.pi)).all()
    assert (found.coherence >= 0).all()
    assert (found.coherence <= 1.0001).all()

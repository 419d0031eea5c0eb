"""Ridges stay where they are, by the network and by filters; orientation and period of waves."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.base.network import Network
from fpmatch.errors import FpmatchError
from fpmatch.image.enhancement import enhancers
from fpmatch.image.enhancement.enhancers import (
    ENHANCED_SHARE,
    MAX_AMPLITUDE,
    NETWORK_FILE,
    blend,
    enhance_by_network,
    enhanced_orientation,
    orientation_at_pixels,
    smoothed_orientation,
)
from fpmatch.image.enhancement.gabor import (
    FILTER_PERIODS_PX,
    doubled_angles,
    filter_bank,
    gabor_filter,
    ridge_period,
)
from fpmatch.image.preprocess.spectrum import ANGLES, PERIODS_PX, ridge_spectrum
from tests.image.made_images import plane_wave, turn_between

CONTRAST = 1.4  # of a wave of unit deviation, as normalised images have


def pixels_of(*shape):
    return arrays(np.float32, shape, elements=st.floats(-3, 3, width=32))


# --- by the network


@given(
    st.tuples(st.integers(1, 90), st.integers(1, 90)),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 1.0, 3.0, 1e6]),
)
@example((48, 200), 0, 1.0)
def test_whatever_goes_in_a_probability_of_its_size_comes_out(shape, seed, height):
    noise = np.random.default_rng(seed).uniform(-height, height, shape).astype(np.float32)
    ridges = enhance_by_network(noise)
    assert (ridges.shape, ridges.dtype) == (shape, np.float32)
    assert (np.abs(ridges) <= 1).all()


def test_threads_at_work_together_find_the_same_ridges():
    waves = [CONTRAST * plane_wave(30 * k, 9, (64 + 16 * k, 120)) for k in range(4)]
    alone = [enhance_by_network(wave) for wave in waves]
    together = Barrier(len(waves))

    def enhanced(wave):
        together.wait()
        return [enhance_by_network(wave) for _ in range(5)]

    with ThreadPoolExecutor(len(waves)) as pool:
        for expected, found in zip(alone, pool.map(enhanced, waves), strict=True):
            assert all(np.array_equal(ridges, expected) for ridges in found)


def unusable(*_):
    cv2.cvtColor(np.zeros((0, 0), np.uint8), cv2.COLOR_BGR2GRAY)  # raises as OpenCV does


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda whole: whole[: len(whole) // 2], "damaged, or the network of another version"),
        (lambda _: None, "No such file"),
        (lambda whole: whole, "cannot use it"),
    ],
)
def test_a_network_that_is_no_use_is_refused_by_name(damage, reason, tmp_path, monkeypatch, capfd):
    path, content = tmp_path / "network.onnx", damage(NETWORK_FILE.read_bytes())
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(enhancers, "_NETWORK", Network(path, enhancers.NETWORK_SHA256))
    monkeypatch.setattr(cv2.dnn, "readNetFromONNX", unusable)
    with pytest.raises(FpmatchError, match=reason) as caught:
        enhance_by_network(np.zeros((32, 32), np.float32))
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


# --- orientation


def whole(pixels):
    return np.ones([-(-side // 8) for side in pixels.shape], bool)


def field_of(pixels, mask):
    return smoothed_orientation(doubled_angles(ridge_spectrum(pixels), mask))


both_methods = pytest.mark.parametrize("field", [field_of, enhanced_orientation])


def error_deg(orientation, true_deg):
    return turn_between(np.degrees(orientation), true_deg, period_deg=180)


@both_methods
@pytest.mark.parametrize("period", [5.5, 9, 14])
@pytest.mark.parametrize("angle", np.arange(0, 180, 22.5))
def test_a_plane_wave_has_its_angle_everywhere(field, angle, period):
    wave = plane_wave(angle, period)
    found = field(wave, whole(wave))
    assert error_deg(found.orientation[3:-3, 3:-3], angle).max() < 2
    assert error_deg(orientation_at_pixels(found.orientation, wave.shape)[24:-24], angle).max() < 6
    assert found.coherence[3:-3, 3:-3].min() > 0.8


@both_methods
@given(pixels=st.tuples(st.integers(1, 40), st.integers(1, 50)).flatmap(lambda s: pixels_of(*s)))
def test_any_pixels_give_angles_below_pi(field, pixels):
    found = field(pixels, whole(pixels))
    for angles in (found.orientation, orientation_at_pixels(found.orientation, pixels.shape)):
        assert ((angles >= 0) & (angles < np.float32(np.pi))).all()
    assert ((found.coherence >= 0) & (found.coherence <= 1.0001)).all()


# --- by filters


@pytest.mark.parametrize("period", PERIODS_PX[::2])
@pytest.mark.parametrize("angle", np.degrees(ANGLES[::3]))
def test_a_sampled_wave_is_the_peak_of_the_spectrum_and_holds_all_energy(angle, period):
    spectrum = ridge_spectrum(plane_wave(angle, period, (72, 75), phase=0.7))
    assert spectrum.total.shape == (9, 10)
    energy = spectrum.energy[4, 4]
    a, f = np.unravel_index(energy.argmax(), energy.shape)
    assert (np.degrees(ANGLES[a]), PERIODS_PX[f]) == pytest.approx((angle, period))
    assert energy.max() / spectrum.total[4, 4] == pytest.approx(1, abs=0.08)
    brighter = ridge_spectrum(plane_wave(angle, period, (72, 75), phase=0.7) + np.float32(0.5))
    assert brighter.energy[4, 4] == pytest.approx(energy, abs=1e-4)


def period_of(pixels, mask):
    spectrum = ridge_spectrum(pixels)
    field = smoothed_orientation(doubled_angles(spectrum, mask))
    return ridge_period(spectrum, field, mask)


@given(st.floats(0, 180), st.floats(6, 13), st.floats(0, 7))
def test_a_plane_wave_has_its_period_everywhere(angle, period, phase):
    wave = plane_wave(angle, period, phase=phase)
    assert period_of(wave, whole(wave))[3:-3, 3:-3] == pytest.approx(period, rel=0.1)


@given(pixels_of(40, 50))
def test_any_pixels_give_a_period_that_the_spectrum_samples(pixels):
    found = period_of(pixels, whole(pixels))
    assert (found >= PERIODS_PX[0] * 0.999).all()
    assert (found <= PERIODS_PX[-1] * 1.001).all()


def test_ridges_outside_the_mask_do_not_influence_those_inside():
    pixels = plane_wave(20, 9, (96, 192))
    other = pixels.copy()
    other[:, 130:] = 5 * plane_wave(110, 7, (96, 62))
    mask = np.zeros((12, 24), bool)
    mask[:, :13] = True
    for field in (field_of, enhanced_orientation):
        one, two = field(pixels, mask), field(other, mask)
        assert np.array_equal(one.orientation[:, :13], two.orientation[:, :13])
        assert error_deg(one.orientation[2:-2, 2:13], 20).max() < 2
    assert np.array_equal(period_of(pixels, mask)[:, :13], period_of(other, mask)[:, :13])


def filtered(pixels, angle_deg, period, mask=None):
    """Filter by one orientation and period everywhere."""
    angle = np.full(pixels.shape, np.radians(angle_deg), np.float32)
    inside = np.ones(pixels.shape, bool) if mask is None else mask
    return gabor_filter(pixels, inside, angle, np.full(pixels.shape, period, np.float32))


@pytest.mark.parametrize("period", FILTER_PERIODS_PX[1:-1:2])
@pytest.mark.parametrize("angle", np.arange(0, 180, 45))
def test_a_wave_passes_its_own_filter_and_no_other(angle, period):
    wave, inside = plane_wave(angle, period), np.s_[20:-20, 20:-20]
    assert filtered(wave, angle, period)[inside] == pytest.approx(wave[inside], abs=0.05)
    assert np.abs(filtered(plane_wave(angle + 90, 9), angle, 9)[inside]).max() < 0.1
    mask = np.arange(wave.size).reshape(wave.shape) % 3 == 0
    assert not filtered(wave, angle, period, mask)[~mask].any()


def test_filters_ignore_brightness_and_the_ends_of_the_bank_hold_beyond(rng):
    assert np.abs(filter_bank().sum(axis=(1, 2))).max() < 1e-5
    pixels = rng.normal(0, 1, (40, 40)).astype(np.float32)
    for angle, period, as_angle, as_period in (
        (179.99, 9, 0, 9),
        (30, 0.1, 30, FILTER_PERIODS_PX[0]),
        (30, np.nan, 30, FILTER_PERIODS_PX[-1]),
    ):
        expected = filtered(pixels, as_angle, as_period)
        assert np.array_equal(filtered(pixels, angle, period), expected)


@given(pixels_of(20, 24), pixels_of(20, 24), arrays(np.bool_, (20, 24)))
def test_the_blend_lies_between_its_bounds_and_in_the_mask(pixels, enhanced, mask):
    out = blend(pixels, enhanced, mask)
    assert not out[~mask].any()
    bound = (1 - ENHANCED_SHARE) * np.abs(pixels) + ENHANCED_SHARE * MAX_AMPLITUDE
    assert (np.abs(out) <= bound + 1e-4).all()

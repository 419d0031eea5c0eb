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
from fpmatch.image.enhancement.gabor import doubled_angles
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.preprocess.spectrum import ridge_spectrum
from tests.image.made_images import (
    correlation,
    hostile_pictures,
    plane_wave,
    turn_between,
)

WAVE = plane_wave(30, 9)
FLOATS = arrays(np.float32, (20, 24), elements=st.floats(-3, 3, width=32))


@given(FLOATS, FLOATS, arrays(np.bool_, (20, 24)))
def test_the_blend_lies_between_its_bounds_and_in_the_mask(pixels, enhanced, mask):
    out = blend(pixels, enhanced, mask)
    assert out.dtype == np.float32
    assert not out[~mask].any()
    bound = (1 - ENHANCED_SHARE) * np.abs(pixels) + ENHANCED_SHARE * MAX_AMPLITUDE
    assert (np.abs(out) <= bound + 1e-4).all()


CONTRAST = 1.4  # of a wave of unit deviation, as normalised images have


@given(
    st.tuples(st.integers(1, 90), st.integers(1, 90)),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.1, 1.0, 3.0, 1e6]),
)
@example((48, 200), 0, 1.0)
def test_whatever_goes_in_a_probability_of_its_size_comes_out(shape, seed, height):
    noise = np.random.default_rng(seed).uniform(-height, height, shape).astype(np.float32)
    ridges = enhance_by_network(noise)
    assert (ridges.shape, ridges.dtype) == (shape, np.float32)
    assert ridges.flags.c_contiguous
    assert (np.abs(ridges) <= 1).all()


@pytest.mark.parametrize("period", [7, 9, 12])
@pytest.mark.parametrize("angle", range(0, 180, 20))
def test_ridges_stay_where_they_are(angle, period):
    wave = CONTRAST * plane_wave(angle, period)
    ridges = enhance_by_network(wave)[16:-16, 16:-16]
    wave = wave[16:-16, 16:-16]
    assert correlation(ridges, wave) > 0.9
    assert ((ridges > 0) == (wave > 0)).mean() > 0.9


@pytest.mark.parametrize("name", ["black", "white", "grey", "noise", "edge"])
def test_where_there_is_no_print_nothing_is_certain(name):
    pixels = normalize(hostile_pictures((160, 200))[name]).pixels
    assert np.mean(enhance_by_network(pixels) ** 2) < 0.1


def test_threads_at_work_together_find_the_same_ridges():
    waves = [CONTRAST * plane_wave(30 * k, 9, (64 + 16 * k, 120)) for k in range(4)]
    kept = [wave.copy() for wave in waves]
    alone = [enhance_by_network(wave) for wave in waves]
    together = Barrier(len(waves))

    def enhanced(wave):
        together.wait()
        return [enhance_by_network(wave) for _ in range(5)]

    with ThreadPoolExecutor(len(waves)) as pool:
        for expected, found in zip(alone, pool.map(enhanced, waves), strict=True):
            assert all(np.array_equal(ridges, expected) for ridges in found)
    assert all(map(np.array_equal, waves, kept))


# --- the file


def unusable(*_):
    cv2.cvtColor(np.zeros((0, 0), np.uint8), cv2.COLOR_BGR2GRAY)  # raises as OpenCV does


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda _: b"", "damaged, or the network of another version"),
        (lambda whole: whole[: len(whole) // 2], "damaged"),
        (lambda whole: whole[:500_000] + bytes(64) + whole[500_064:], "damaged"),
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

"""Ridges where there are some, and nothing where there are none."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from made_images import correlation, dislocation, hostile_pictures, plane_wave

from fpmatch.errors import FpmatchError
from fpmatch.image.enhancement import enhancers
from fpmatch.image.enhancement.enhancers import NETWORK_FILE, SIDE_STEP_PX, enhance_by_network
from fpmatch.image.preprocess.normalize import normalize

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


def test_noise_between_ridges_is_taken_away(rng):
    clean = CONTRAST * dislocation(50, 9, "ending")
    noisy = (clean + rng.normal(0, 1, clean.shape)).astype(np.float32) / np.float32(np.sqrt(2))
    inside = np.s_[16:-16, 16:-16]
    before, after = (
        ((pixels > 0) == (clean > 0))[inside].mean()
        for pixels in (noisy, enhance_by_network(noisy))
    )
    assert after > 0.93 > before


@pytest.mark.parametrize("name", ["black", "white", "grey", "noise", "edge"])
def test_where_there_is_no_print_nothing_is_certain(name):
    pixels = normalize(hostile_pictures((160, 200))[name]).pixels
    assert np.mean(enhance_by_network(pixels) ** 2) < 0.1


@pytest.mark.parametrize(("down", "right"), [(16, 0), (0, 32), (48, 16)])
def test_moved_by_whole_steps_all_moves_with_it(down, right):
    assert down % SIDE_STEP_PX == right % SIDE_STEP_PX == 0
    wave = CONTRAST * dislocation(50, 9, "ending", (128, 144))
    one, other = (
        enhance_by_network(np.pad(wave, ((128 + dy, 128), (128 + dx, 128))))
        for dy, dx in ((0, 0), (down, right))
    )
    moved = other[128 + down :, 128 + right :]
    np.testing.assert_allclose(moved, one[128:, 128:], rtol=0, atol=1e-4)


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
    monkeypatch.setattr(enhancers, "NETWORK_FILE", path)
    monkeypatch.setattr(enhancers, "_own", type(enhancers._own)())
    monkeypatch.setattr(cv2.dnn, "readNetFromONNX", unusable)
    with pytest.raises(FpmatchError, match=reason) as caught:
        enhance_by_network(np.zeros((32, 32), np.float32))
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")

"""Ridges where there are some, and nothing where there are none."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_images import dislocation, hostile_pictures, plane_wave

from fpmatch.errors import FpmatchError
from fpmatch.image.enhancement import network
from fpmatch.image.enhancement.network import NETWORK_FILE, SIDE_STEP_PX, enhance_by_network
from fpmatch.image.preprocess.normalize import normalize

CONTRAST = 1.4  # of a wave of unit deviation, as normalised images have


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (33, 1), (15, 16), (16, 17), (48, 200)])
def test_what_comes_out_has_the_size_of_what_goes_in(shape: tuple[int, int]) -> None:
    ridges = enhance_by_network(CONTRAST * plane_wave(30, 9, shape))
    assert ridges.shape == shape
    assert ridges.dtype == np.float32
    assert ridges.flags.c_contiguous


@settings(max_examples=30)
@given(
    st.tuples(st.integers(1, 90), st.integers(1, 90)),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.1, 1.0, 3.0, 1e6]),
)
def test_whatever_goes_in_a_probability_comes_out(
    shape: tuple[int, int], seed: int, height: float
) -> None:
    noise = np.random.default_rng(seed).uniform(-height, height, shape).astype(np.float32)
    ridges = enhance_by_network(noise)
    assert ridges.shape == shape
    assert (np.abs(ridges) <= 1).all()


@pytest.mark.parametrize("period", [7, 9, 12])
@pytest.mark.parametrize("angle", range(0, 180, 20))
def test_ridges_stay_where_they_are(angle: int, period: int) -> None:
    wave = CONTRAST * plane_wave(angle, period)
    ridges = enhance_by_network(wave)[16:-16, 16:-16]
    wave = wave[16:-16, 16:-16]
    assert np.corrcoef(ridges.ravel(), wave.ravel())[0, 1] > 0.9
    assert ((ridges > 0) == (wave > 0)).mean() > 0.9


def test_noise_between_ridges_is_taken_away(rng: np.random.Generator) -> None:
    clean = CONTRAST * dislocation(50, 9, "ending")
    noisy = (clean + rng.normal(0, 1, clean.shape)).astype(np.float32) / np.float32(np.sqrt(2))
    inside = np.s_[16:-16, 16:-16]
    before, after = (
        ((pixels > 0) == (clean > 0))[inside].mean()
        for pixels in (noisy, enhance_by_network(noisy))
    )
    assert after > 0.93 > before


@pytest.mark.parametrize("name", ["black", "white", "grey", "noise", "edge"])
def test_where_there_is_no_print_nothing_is_certain(name: str) -> None:
    pixels = normalize(hostile_pictures((160, 200))[name]).pixels
    assert np.mean(enhance_by_network(pixels) ** 2) < 0.1


@pytest.mark.parametrize(("down", "right"), [(16, 0), (0, 32), (48, 16)])
def test_moved_by_whole_steps_all_moves_with_it(down: int, right: int) -> None:
    assert down % SIDE_STEP_PX == right % SIDE_STEP_PX == 0
    wave = CONTRAST * dislocation(50, 9, "ending", (128, 144))
    one, other = (
        enhance_by_network(np.pad(wave, ((128 + dy, 128), (128 + dx, 128))))
        for dy, dx in ((0, 0), (down, right))
    )
    np.testing.assert_allclose(
        other[128 + down :, 128 + right :], one[128:, 128:], rtol=0, atol=1e-4
    )


def test_the_same_image_gives_the_same_ridges_after_others_of_other_sizes() -> None:
    wave = CONTRAST * plane_wave(70, 9, (90, 70))
    kept = wave.copy()
    first = enhance_by_network(wave)
    for shape in ((20, 200), (130, 60)):
        enhance_by_network(CONTRAST * plane_wave(10, 8, shape))
        assert np.array_equal(enhance_by_network(wave), first)
    assert np.array_equal(wave, kept)


def test_threads_at_work_together_find_the_same_ridges() -> None:
    waves = [CONTRAST * plane_wave(30 * k, 9, (64 + 16 * k, 120)) for k in range(4)]
    alone = [enhance_by_network(wave) for wave in waves]
    together = Barrier(len(waves))

    def enhanced(wave: np.ndarray) -> list[np.ndarray]:
        together.wait()
        return [enhance_by_network(wave) for _ in range(5)]

    with ThreadPoolExecutor(len(waves)) as pool:
        for expected, found in zip(alone, pool.map(enhanced, waves), strict=True):
            for ridges in found:
                assert np.array_equal(ridges, expected)


# --- the file


def cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def altered(content: bytes) -> bytes:
    return content[:500_000] + bytes(64) + content[500_064:]


@pytest.fixture
def another_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[bytes | None], Path]:
    """Return what puts other content, or none, in the place of the network."""

    def put(content: bytes | None) -> Path:
        path = tmp_path / "network.onnx"
        if content is not None:
            path.write_bytes(content)
        monkeypatch.setattr(network, "NETWORK_FILE", path)
        monkeypatch.setattr(network, "_own", type(network._own)())
        return path

    return put


@pytest.mark.parametrize("damage", [lambda _: b"", lambda _: b"text\n", cut, altered])
def test_a_damaged_network_is_refused_by_name(
    another_file: Callable[[bytes | None], Path],
    damage: Callable[[bytes], bytes],
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = another_file(damage(NETWORK_FILE.read_bytes()))
    with pytest.raises(FpmatchError, match="damaged, or the network of another version") as caught:
        enhance_by_network(np.zeros((32, 32), np.float32))
    assert str(caught.value).startswith(f"{path}: ")
    assert capfd.readouterr() == ("", "")


def test_a_missing_network_is_missed_by_name(
    another_file: Callable[[bytes | None], Path],
) -> None:
    path = another_file(None)
    with pytest.raises(FpmatchError, match="No such file") as caught:
        enhance_by_network(np.zeros((32, 32), np.float32))
    assert str(caught.value).startswith(f"{path}: ")


def test_a_network_that_opencv_cannot_use_is_refused_by_name(
    monkeypatch: pytest.MonkeyPatch, another_file: Callable[[bytes | None], Path]
) -> None:
    def unusable(*_: object) -> None:
        cv2.cvtColor(np.zeros((0, 0), np.uint8), cv2.COLOR_BGR2GRAY)  # raises as OpenCV does

    path = another_file(NETWORK_FILE.read_bytes())
    monkeypatch.setattr(cv2.dnn, "readNetFromONNX", unusable)
    with pytest.raises(FpmatchError, match="cannot use it") as caught:
        enhance_by_network(np.zeros((32, 32), np.float32))
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)

"""100 where image and ridges agree, 0 where they do not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import plane_wave

from fpmatch.image.skeleton.minutia_quality import QualityParameters, minutia_quality

WAVE = plane_wave(30, 9, (90, 110))
X, Y = np.array([0, 50, 109, 20], np.int32), np.array([0, 40, 89, 70], np.int32)


def test_no_minutiae_have_no_quality() -> None:
    none = np.empty(0, np.int32)
    found = minutia_quality(WAVE, WAVE, none, none)
    assert found.shape == (0,)
    assert found.dtype == np.uint8


@pytest.mark.parametrize("scale", [0.01, 1, 50])
def test_an_image_like_its_enhancement_is_perfect_at_any_scale_and_place(scale: float) -> None:
    assert minutia_quality(WAVE, np.float32(scale) * WAVE, X, Y).tolist() == [100] * 4


def test_an_inverted_image_is_worthless() -> None:
    assert minutia_quality(-WAVE, WAVE, X, Y).tolist() == [0] * 4


@pytest.mark.parametrize("empty", ["image", "enhancement", "both"])
def test_where_there_is_nothing_quality_is_zero(empty: str) -> None:
    nothing = np.zeros_like(WAVE)
    pixels = nothing if empty in {"image", "both"} else WAVE
    enhanced = nothing if empty in {"enhancement", "both"} else WAVE
    assert minutia_quality(pixels, enhanced, X, Y).tolist() == [0] * 4


def test_noise_lowers_quality_step_by_step(rng: np.random.Generator) -> None:
    noise = rng.normal(0, 1, WAVE.shape).astype(np.float32)
    grades = [
        int(minutia_quality(WAVE + np.float32(s) * noise, WAVE, X[1:2], Y[1:2])[0])
        for s in (0, 0.3, 1, 3, 10)
    ]
    assert grades == sorted(grades, reverse=True)
    assert len(set(grades)) == len(grades)


def test_only_the_neighbourhood_counts(rng: np.random.Generator) -> None:
    p = QualityParameters(radius_px=10, sigma_px=5.0)
    spoilt = WAVE.copy()
    spoilt[:, 62:] = rng.normal(0, 5, spoilt[:, 62:].shape)
    x, y = np.array([51, 80]), np.array([40, 40])
    near, far = minutia_quality(spoilt, WAVE, x, y, p).tolist()
    assert near == 100
    assert far < 60


def test_a_minutia_is_graded_alone_as_in_company(rng: np.random.Generator) -> None:
    noisy = WAVE + rng.normal(0, 1, WAVE.shape).astype(np.float32)
    together = minutia_quality(noisy, WAVE, X, Y)
    alone = [int(minutia_quality(noisy, WAVE, X[k : k + 1], Y[k : k + 1])[0]) for k in range(4)]
    assert together.tolist() == alone


@given(
    arrays(np.float32, (12, 15), elements=st.floats(-3, 3, width=32)),
    arrays(np.float32, (12, 15), elements=st.floats(-3, 3, width=32)),
    st.integers(0, 14),
    st.integers(0, 11),
)
def test_quality_is_symmetric_and_within_0_to_100(
    one: np.ndarray, other: np.ndarray, x: int, y: int
) -> None:
    at = np.array([x]), np.array([y])
    grade = int(minutia_quality(one, other, *at)[0])
    assert 0 <= grade <= 100
    assert grade == int(minutia_quality(other, one, *at)[0])


def test_weights_fall_off_as_a_gaussian_and_end_with_the_image(rng: np.random.Generator) -> None:
    p = QualityParameters(radius_px=4, sigma_px=2.0)
    a, b = rng.normal(0, 1, (2, 9, 12)) + 1
    rows, columns = np.indices(a.shape)
    for x, y in ((0, 0), (5, 4), (11, 8)):
        dy, dx = rows - y, columns - x
        weight = np.exp(-(dx**2 + dy**2) / 8.0) * (np.maximum(abs(dx), abs(dy)) <= 4)
        expected = (weight * a * b).sum() / np.sqrt((weight * a * a).sum() * (weight * b * b).sum())
        images = a.astype(np.float32), b.astype(np.float32)
        found = minutia_quality(*images, np.array([x]), np.array([y]), p)
        assert found[0] == max(0, round(100 * expected))

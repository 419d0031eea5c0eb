"""100 where image and ridges agree, 0 where they do not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import plane_wave

from fpmatch.image.skeleton.minutiae import RADIUS_PX, SIGMA_PX, minutia_quality

WAVE = plane_wave(30, 9, (90, 110))
NOTHING = np.zeros_like(WAVE)
X, Y = np.array([0, 50, 109, 20], np.int32), np.array([0, 40, 89, 70], np.int32)


def test_no_minutiae_have_no_quality():
    found = minutia_quality(WAVE, WAVE, X[:0], Y[:0])
    assert (found.shape, found.dtype) == ((0,), np.uint8)


@pytest.mark.parametrize(
    ("pixels", "enhanced", "quality"),
    [
        *((WAVE, np.float32(scale) * WAVE, 100) for scale in (0.01, 1, 50)),
        (-WAVE, WAVE, 0),
        (NOTHING, WAVE, 0),
        (WAVE, NOTHING, 0),
        (NOTHING, NOTHING, 0),
    ],
)
def test_an_image_like_its_enhancement_is_perfect_and_an_inverted_or_empty_one_worthless(
    pixels, enhanced, quality
):
    assert minutia_quality(pixels, enhanced, X, Y).tolist() == [quality] * 4


def test_noise_lowers_quality_step_by_step_and_in_the_neighbourhood_alone(rng):
    noise = rng.normal(0, 1, WAVE.shape).astype(np.float32)
    grades = [
        int(minutia_quality(WAVE + np.float32(s) * noise, WAVE, X[1:2], Y[1:2])[0])
        for s in (0, 0.3, 1, 3, 10)
    ]
    assert grades == sorted(set(grades), reverse=True)
    spoilt = np.where(np.arange(110) < 51 + RADIUS_PX + 1, WAVE, 5 * noise)
    near, far = minutia_quality(spoilt, WAVE, np.array([51, 80]), np.array([40, 40])).tolist()
    assert near == 100
    assert far < 60


def test_a_minutia_is_graded_alone_as_in_company(rng):
    noisy = WAVE + rng.normal(0, 1, WAVE.shape).astype(np.float32)
    together = minutia_quality(noisy, WAVE, X, Y)
    alone = [int(minutia_quality(noisy, WAVE, X[k : k + 1], Y[k : k + 1])[0]) for k in range(4)]
    assert together.tolist() == alone


@given(
    arrays(np.float32, (2, 12, 15), elements=st.floats(-3, 3, width=32)),
    st.integers(0, 14),
    st.integers(0, 11),
)
def test_quality_is_symmetric_and_within_0_to_100(images, x, y):
    at = np.array([x]), np.array([y])
    grade = int(minutia_quality(*images, *at)[0])
    assert 0 <= grade <= 100
    assert grade == int(minutia_quality(*images[::-1], *at)[0])


def test_weights_fall_off_as_a_gaussian_and_end_with_the_image(rng):
    a, b = rng.normal(0, 1, (2, 35, 50)).astype(np.float32) + 1
    rows, columns = np.indices(a.shape)
    for x, y in ((0, 0), (20, 16), (49, 34)):
        dy, dx = rows - y, columns - x
        weight = np.exp(-(dx**2 + dy**2) / (2 * SIGMA_PX**2))
        weight *= np.maximum(abs(dx), abs(dy)) <= RADIUS_PX
        expected = (weight * a * b).sum() / np.sqrt((weight * a * a).sum() * (weight * b * b).sum())
        found = minutia_quality(a, b, np.array([x]), np.array([y]))
        assert found[0] == max(0, round(100 * expected))

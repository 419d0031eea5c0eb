import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.synthesis.growth import GrowthParameters, grow_ridges, without_dots_and_holes

SHAPE = (120, 128)


def even_field(angle_deg, period_px):
    orientation = np.full(SHAPE, np.radians(angle_deg), np.float32)
    return orientation, np.full(SHAPE, period_px, np.float32)


def grown(angle, period, seed, **changes):
    rng = np.random.default_rng(seed)
    return grow_ridges(*even_field(angle, period), rng, GrowthParameters(**changes))


def mean_wave(relief):
    """Return period in pixels and orientation in degrees of the strongest waves, on average."""
    windowed = relief * np.hanning(SHAPE[0])[:, None] * np.hanning(SHAPE[1])
    power = np.abs(np.fft.fft2(windowed, (512, 512))) ** 2
    v, u = np.meshgrid(-np.fft.fftfreq(512), np.fft.fftfreq(512), indexing="ij")
    weight = power * (power > 0.05 * power.max())
    doubled = np.sum(weight * (u + 1j * v) ** 2)
    frequency = np.sum(weight * np.hypot(u, v)) / weight.sum()
    return 1 / frequency, np.degrees(np.angle(doubled) / 2 + np.pi / 2) % 180


@pytest.mark.parametrize("angle", [0, 30, 72, 90, 135])
@pytest.mark.parametrize("period", [7.5, 9, 11])
def test_ridges_follow_the_field(angle, period):
    relief = grown(angle, period, 4)
    found_period, found_angle = mean_wave(relief)
    assert found_period == pytest.approx(period, rel=0.15)  # taps are whole pixels
    assert abs((found_angle - angle + 90) % 180 - 90) < 5


@settings(max_examples=10)
@given(st.floats(0, 180), st.floats(6, 13), st.integers(0, 2**32))
def test_the_print_is_filled_half_by_ridges(angle, period, seed):
    relief = grown(angle, period, seed)
    assert relief.dtype == np.float32
    assert np.abs(relief).max() <= 1
    assert 0.4 < (relief > 0).mean() < 0.6
    assert np.mean(np.abs(relief) < 0.25) < 0.25


def test_one_seed_is_enough():
    relief = grown(20, 9, 0, seeds_per_square_period=0, steps=40)
    assert np.mean(np.abs(relief) > 0.25) > 0.7


def test_dots_vanish_and_holes_close_but_ridges_stay():
    relief = np.full((40, 60), -0.5, np.float32)
    relief[10:15] = 0.75  # a ridge
    relief[12, 20:22] = -0.25  # a hole in it
    relief[25:27, 30:32] = 0.5  # a dot
    relief[32:36, 5:50] = 0.5  # an island, too long for a dot
    expected = relief.copy()
    expected[12, 20:22] = 0.25
    expected[25:27, 30:32] = -0.5
    largest = np.full_like(relief, 40)
    np.testing.assert_array_equal(without_dots_and_holes(relief, largest), expected)
    for even in (relief * 0 - 1, relief * 0 + 1):
        np.testing.assert_array_equal(without_dots_and_holes(even, largest), even)

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.lab.synthesis.master import grow_ridges, list_minutiae, without_dots_and_holes
from fpmatch.templates.minutiae import MinutiaKind

SHAPE = (120, 128)


def even_field(angle_deg, period_px):
    orientation = np.full(SHAPE, np.radians(angle_deg), np.float32)
    return orientation, np.full(SHAPE, period_px, np.float32)


def grown(angle, period, seed):
    rng = np.random.default_rng(seed)
    return grow_ridges(*even_field(angle, period), rng)


@settings(max_examples=10)
@given(st.floats(0, 180), st.floats(6, 13), st.integers(0, 2**32))
def test_the_print_is_filled_half_by_ridges(angle, period, seed):
    relief = grown(angle, period, seed)
    assert relief.dtype == np.float32
    assert np.abs(relief).max() <= 1
    assert 0.4 < (relief > 0).mean() < 0.6
    assert np.mean(np.abs(relief) < 0.25) < 0.25


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


SIDE = 120
MIDDLE = SIDE // 2
PERIOD = 9.0


def minutiae_of(lines, angle_deg=0.0, silhouette=None):
    """List the minutiae of ridges drawn as thick lines, all turned by `angle_deg`."""
    pixels = np.zeros((SIDE, SIDE), np.uint8)
    turn = np.exp(1j * np.radians(angle_deg))
    for ends in lines:
        start, stop = ((MIDDLE + (turn * end).real, MIDDLE - (turn * end).imag) for end in ends)
        cv2.line(pixels, *(tuple(round(c) for c in end) for end in (start, stop)), 1, 4)
    relief = pixels.astype(np.float32) * 2 - 1
    orientation = np.full(relief.shape, np.radians(angle_deg) % np.pi, np.float32)
    inside = np.ones(relief.shape, bool) if silhouette is None else silhouette
    period = np.full_like(relief, PERIOD)
    return list_minutiae(relief, orientation, period, inside)


def the_one(found, kind, angle_deg, within_px=3):
    assert found.kind.tolist() == [kind]
    assert np.hypot(found.x[0] - MIDDLE, found.y[0] - MIDDLE) < within_px
    turn = np.exp(1j * (found.angle[0] - np.radians(angle_deg)))
    assert abs(np.angle(turn)) < 0.01


@pytest.mark.parametrize("angle", range(0, 360, 24))
def test_an_ending_points_back_along_its_ridge_and_a_fork_into_the_valley_in_it(angle):
    the_one(minutiae_of([(0, 100)], angle), MinutiaKind.ENDING, angle)
    fork = [(-100, 0), (0, 100 + 45j), (0, 100 - 45j)]
    the_one(minutiae_of(fork, angle), MinutiaKind.BIFURCATION, angle, within_px=7)


def test_minutiae_come_from_top_to_bottom_and_side_by_side_if_far_enough():
    found = minutiae_of([(30 - 20j, 100 - 20j), (10 + 0j, 100 + 0j), (-20 + 20j, 100 + 20j)])
    assert found.y.tolist() == sorted(found.y.tolist())
    assert len(found) == 3
    found = minutiae_of([(0, 100), (0 + 12j, 100 + 12j)])
    assert found.kind.tolist() == [MinutiaKind.ENDING] * 2


@pytest.mark.parametrize(
    "lines",
    [
        pytest.param([], id="nothing"),
        pytest.param([(-100, 100)], id="a ridge from border to border"),
        pytest.param([(-100, -5), (5, 100)], id="a break"),
        pytest.param([(-100, 100), (0, 7j)], id="a spur"),
        pytest.param([(-3, 3)], id="an island"),
        pytest.param([(-100, 4), (0 + 7j, 100 + 7j)], id="two endings too near each other"),
        pytest.param([(-100, 100), (-100 + 7j, 100 + 7j), (0, 7j)], id="a bridge"),
        pytest.param([(100 - 3, 100 + 3)], id="beyond the border"),
        pytest.param([(MIDDLE - 6, 100)], id="at the border"),
        pytest.param([(y * 1j - 99, y * 1j + 99) for y in range(-70, 71)], id="ridge all over"),
    ],
)
def test_flaws_are_no_minutiae(lines):
    assert len(minutiae_of(lines)) == 0


def test_nothing_is_listed_outside_the_silhouette():
    left = np.zeros((SIDE, SIDE), bool)
    left[:, : MIDDLE - 10] = True
    assert len(minutiae_of([(0, 100)], silhouette=left)) == 0
    assert len(minutiae_of([(0, 100)], silhouette=~left)) == 1

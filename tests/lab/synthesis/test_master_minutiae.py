import cv2
import numpy as np
import pytest

from fpmatch.lab.synthesis.master_minutiae import MinutiaeParameters, list_minutiae
from fpmatch.templates.minutiae import MinutiaKind

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
    return list_minutiae(relief, orientation, period, inside, MinutiaeParameters())


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


def test_minutiae_come_from_top_to_bottom():
    found = minutiae_of([(30 - 20j, 100 - 20j), (10 + 0j, 100 + 0j), (-20 + 20j, 100 + 20j)])
    assert found.y.tolist() == sorted(found.y.tolist())
    assert len(found) == 3


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


def test_two_endings_side_by_side_but_far_enough_are_both_listed():
    found = minutiae_of([(0, 100), (0 + 12j, 100 + 12j)])
    assert found.kind.tolist() == [MinutiaKind.ENDING] * 2


def test_nothing_is_listed_outside_the_silhouette():
    left = np.zeros((SIDE, SIDE), bool)
    left[:, : MIDDLE - 10] = True
    assert len(minutiae_of([(0, 100)], silhouette=left)) == 0
    assert len(minutiae_of([(0, 100)], silhouette=~left)) == 1

"""Singular where it should be, smooth elsewhere, arching."""

from __future__ import annotations

import numpy as np
import pytest

from fpmatch.synthesis.classes import PatternClass, SingularPoints, draw_singular_points
from fpmatch.synthesis.orientation import (
    ORIENTATION_LEVELS,
    OrientationParameters,
    ridge_orientation,
)

SHAPE = (280, 220)
SIZE = 0.5
CENTRE = (110.0, 140.0)


def field_of(pattern: PatternClass, seed: int = 0) -> tuple[np.ndarray, SingularPoints]:
    rng = np.random.default_rng(seed)
    points = draw_singular_points(pattern, CENTRE, rng, size=SIZE)
    return ridge_orientation(pattern, points, SHAPE, rng, size=SIZE), points


def index_at(orientation: np.ndarray, x: float, y: float, radius: float = 7.0) -> float:
    around = np.linspace(0, 2 * np.pi, 200)
    column = np.rint(x + radius * np.cos(around)).astype(int)
    row = np.rint(y - radius * np.sin(around)).astype(int)
    steps = np.mod(np.diff(orientation[row, column]) + np.pi / 2, np.pi) - np.pi / 2
    return float(steps.sum() / np.pi)


@pytest.mark.parametrize("pattern", PatternClass)
def test_cores_and_deltas_are_where_they_were_put(pattern: PatternClass) -> None:
    for seed in range(3):
        orientation, points = field_of(pattern, seed)
        for x, y in points.cores:
            assert index_at(orientation, x, y) == pytest.approx(1, abs=1e-3)
        for x, y in points.deltas:
            assert index_at(orientation, x, y) == pytest.approx(-1, abs=1e-3)


@pytest.mark.parametrize("pattern", PatternClass)
def test_orientations_are_whole_levels_below_pi(pattern: PatternClass) -> None:
    orientation, _ = field_of(pattern)
    assert orientation.shape == SHAPE
    assert orientation.dtype == np.float32
    assert orientation.min() >= 0
    assert orientation.max() < np.float32(np.pi)
    levels = orientation.astype(np.float64) * ORIENTATION_LEVELS / np.pi
    assert np.abs(levels - np.rint(levels)).max() < 1e-3


@pytest.mark.parametrize("pattern", PatternClass)
def test_ridges_rise_on_the_left_and_fall_on_the_right_of_the_tip(pattern: PatternClass) -> None:
    orientation, _ = field_of(pattern)
    rise = np.sin(2 * orientation[20:60])
    assert rise[:, 20:70].mean() > 0.3
    assert rise[:, 150:200].mean() < -0.3


def test_fingers_of_a_class_differ() -> None:
    one, other = (field_of(PatternClass.ARCH, seed)[0] for seed in (1, 2))
    turn = np.abs(np.mod(one - other + np.pi / 2, np.pi) - np.pi / 2)
    assert np.degrees(turn.mean()) > 2


def test_variation_can_be_switched_off() -> None:
    calm = OrientationParameters(variation_deg=(0, 0))
    none = SingularPoints(np.empty((0, 2)), np.empty((0, 2)))
    orientation = ridge_orientation(
        PatternClass.ARCH, none, SHAPE, np.random.default_rng(0), calm, size=SIZE
    )
    assert not orientation[:, 110].any()  # level all along the middle

"""Natural shares, and singular points where each class has them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.synthesis.classes import (
    NATURAL_SHARES,
    SINGULAR_RANGES,
    PatternClass,
    draw_pattern,
    draw_singular_points,
)

CENTRE = (220.0, 280.0)
EXPECTED_POINTS = {  # cores, deltas
    PatternClass.ARCH: (0, 0),
    PatternClass.TENTED_ARCH: (1, 1),
    PatternClass.LEFT_LOOP: (1, 1),
    PatternClass.RIGHT_LOOP: (1, 1),
    PatternClass.WHORL: (2, 2),
}


def test_shares_are_those_of_nature(rng: np.random.Generator) -> None:
    assert sum(NATURAL_SHARES.values()) == pytest.approx(1.0)
    n = 4000
    drawn = [draw_pattern(rng) for _ in range(n)]
    for pattern, share in NATURAL_SHARES.items():
        deviation = np.sqrt(share * (1 - share) / n)
        assert abs(drawn.count(pattern) / n - share) < 4 * deviation


@given(st.sampled_from(PatternClass), st.integers(0, 2**32), st.floats(0.2, 1.2))
def test_points_are_as_many_as_the_class_has_and_cores_lie_above_deltas(
    pattern: PatternClass, seed: int, size: float
) -> None:
    points = draw_singular_points(pattern, CENTRE, np.random.default_rng(seed), size)
    assert (len(points.cores), len(points.deltas)) == EXPECTED_POINTS[pattern]
    assert points.cores.shape[1:] == points.deltas.shape[1:] == (2,)
    if len(points.cores):
        assert points.cores[:, 1].max() < points.deltas[:, 1].min()
    corners = [
        abs(end) for rectangle in SINGULAR_RANGES[pattern].deltas for end in np.ravel(rectangle)
    ]
    assert np.abs(points.deltas - CENTRE).max(initial=0) <= size * max(corners, default=0) + 1e-9


@given(st.integers(0, 2**32))
def test_a_left_loop_has_its_delta_on_the_right_and_a_right_loop_on_the_left(seed: int) -> None:
    left, right = (
        draw_singular_points(pattern, CENTRE, np.random.default_rng(seed))
        for pattern in (PatternClass.LEFT_LOOP, PatternClass.RIGHT_LOOP)
    )
    assert left.deltas[0, 0] > left.cores[0, 0]
    assert right.deltas[0, 0] < right.cores[0, 0]


def test_fingers_of_a_class_differ(rng: np.random.Generator) -> None:
    cores = [draw_singular_points(PatternClass.WHORL, CENTRE, rng).cores for _ in range(20)]
    assert np.std(cores, axis=0).min() > 5

"""Thin lines, none where none are asked for."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.synthesis.lines import draw_lines


@settings(max_examples=10)
@given(st.integers(1, 5), st.integers(0, 2**32))
def test_lines_are_thin_and_lie_between_0_and_1(count: int, seed: int) -> None:
    lines = draw_lines((150, 130), count, np.random.default_rng(seed))
    assert lines.dtype == np.float32
    assert lines.min() == 0
    assert 0.2 < lines.max() <= 1
    assert (lines > 0.2).mean() < 0.05 * count


def test_no_lines_leave_the_picture_empty() -> None:
    assert not draw_lines((30, 20), 0, np.random.default_rng(1)).any()


def test_the_same_numbers_draw_the_same_lines() -> None:
    one, two = (draw_lines((90, 80), 3, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(one, two)

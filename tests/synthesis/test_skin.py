"""Roughness, pores, creases and scratches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.synthesis.master import Master, MasterParameters, make_master
from fpmatch.synthesis.skin import PORE_DEPTH, draw_lines, draw_pores, skin_of


@pytest.fixture(scope="module")
def master() -> Master:
    return make_master(3, 0, MasterParameters(shape=(120, 112)))


def test_another_finger_of_the_same_ridges_has_another_skin(master: Master) -> None:
    other = make_master(3, 1, MasterParameters(shape=(120, 112)))
    roughness, others = (skin_of(m).relief - m.relief for m in (master, other))
    assert abs(np.corrcoef(roughness.ravel(), others.ravel())[0, 1]) < 0.1


def test_pores_are_pits_on_crests_that_keep_apart(master: Master) -> None:
    depth = draw_pores(master.relief, np.random.default_rng(1))
    assert depth.min() >= 0
    pits = np.argwhere(depth > 0.7 * PORE_DEPTH)
    assert len(pits) > 20
    assert (master.relief[tuple(pits.T)] > 0).mean() > 0.95
    valley = np.full((50, 40), -1.0, np.float32)
    assert not draw_pores(valley, np.random.default_rng(1)).any()


@settings(max_examples=10)
@given(st.integers(1, 5), st.integers(0, 2**32))
def test_lines_are_thin_and_lie_between_0_and_1(count: int, seed: int) -> None:
    lines, again = (draw_lines((150, 130), count, np.random.default_rng(seed)) for _ in range(2))
    assert lines.dtype == np.float32
    assert lines.min() == 0
    assert 0.2 < lines.max() <= 1
    assert (lines > 0.2).mean() < 0.05 * count
    np.testing.assert_array_equal(lines, again)


def test_no_lines_leave_the_picture_empty() -> None:
    assert not draw_lines((30, 20), 0, np.random.default_rng(1)).any()

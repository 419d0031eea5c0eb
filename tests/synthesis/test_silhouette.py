"""One piece without a hole, off the border, round at the tip."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from fpmatch.synthesis.silhouette import fingertip_silhouette


@given(st.integers(64, 160), st.integers(64, 160), st.integers(0, 2**32))
def test_any_outline_is_one_piece_off_the_border(rows: int, columns: int, seed: int) -> None:
    inside = fingertip_silhouette((rows, columns), np.random.default_rng(seed))
    assert inside.shape == (rows, columns)
    assert inside.dtype == np.bool_
    assert ndimage.label(inside)[1] == 1
    assert ndimage.label(~inside)[1] == 1
    assert not inside[[0, -1]].any()
    assert not inside[:, [0, -1]].any()
    assert 0.45 < inside.mean() < 0.85


def test_the_tip_is_rounder_than_the_foot(rng: np.random.Generator) -> None:
    inside = np.mean([fingertip_silhouette((300, 240), rng) for _ in range(20)], axis=0)
    assert inside[45].sum() < inside[-46].sum()


def test_fingers_differ(rng: np.random.Generator) -> None:
    areas = [fingertip_silhouette((300, 240), rng).mean() for _ in range(10)]
    assert np.std(areas) > 0.01

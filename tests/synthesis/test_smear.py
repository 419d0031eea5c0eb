"""Patches of skin that moved, the rest as it was."""

from __future__ import annotations

import numpy as np

from fpmatch.synthesis.smear import SmearParameters, smear, stain

ALWAYS = SmearParameters(chance=1.0, share=(0.2, 0.2), extent_px=20.0)


def skin() -> np.ndarray:
    y, x = np.mgrid[:120, :110]
    return np.cos(2 * np.pi * (x + y) / 13).astype(np.float32)


def test_skin_that_never_moves_stays() -> None:
    still, share = smear(skin(), np.random.default_rng(1), SmearParameters(chance=0.0))
    np.testing.assert_array_equal(still, skin())
    assert not share.any()


def test_patches_are_blurred_and_the_rest_stays() -> None:
    moved, share = smear(skin(), np.random.default_rng(2), ALWAYS)
    assert share.min() == 0
    assert share.max() > 0.9
    assert 0.15 < (share > 0).mean() < 0.25
    np.testing.assert_array_equal(moved[share == 0], skin()[share == 0])
    assert np.abs(moved - skin())[share > 0.5].mean() > 0.01


def test_stains_lie_where_the_finger_touches_and_are_no_darker_than_said() -> None:
    touching = np.zeros((120, 110))
    touching[:, :60] = 1
    stained = stain(touching, np.random.default_rng(4), SmearParameters(stain=(0.3, 0.3)))
    assert not stained[:, 60:].any()
    assert 0.05 < stained.max() <= 0.3
    assert stained.dtype == np.float32
    clean = SmearParameters(stain=(0.0, 0.0))
    assert not stain(touching, np.random.default_rng(4), clean).any()

"""Positive pixels in the mask, without specks and pores."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import Binary, binaries, blobs, drawn, parts, plane_wave, strips_and_extremes

from fpmatch.image.skeleton import _small_parts_kernel as kernel
from fpmatch.image.skeleton.binarize import (
    BinarizationParameters,
    binarize,
    flip_with_kernel,
    flip_with_opencv,
)

KEEP_ALL = BinarizationParameters(min_ridge_area_px=0, min_hole_area_px=0)


def as_enhanced(ridges: Binary) -> np.ndarray:
    return np.where(ridges, 1, -1).astype(np.float32)


def whole(ridges: Binary) -> Binary:
    return np.ones(ridges.shape, bool)


@pytest.mark.parametrize("name", strips_and_extremes())
def test_it_is_the_sign_without_what_is_smaller_than_the_least_area(name: str) -> None:
    ridges = strips_and_extremes()[name]
    assert np.array_equal(binarize(as_enhanced(ridges), whole(ridges), KEEP_ALL), ridges)
    large = BinarizationParameters(min_ridge_area_px=ridges.size + 1, min_hole_area_px=0)
    assert not binarize(as_enhanced(ridges), whole(ridges), large).any()


@pytest.mark.parametrize("angle", [0, 33, 90])
def test_a_wave_becomes_stripes_of_half_the_ground(angle: float) -> None:
    wave = plane_wave(angle, 9)
    ridges = binarize(wave, whole(wave > 0))
    middle = (slice(16, 80), slice(16, 80))
    assert np.array_equal(ridges[middle], wave[middle] > 0)
    assert ridges.mean() == pytest.approx(0.5, abs=0.05)


def test_zero_is_no_ridge() -> None:
    assert not binarize(np.zeros((30, 30), np.float32), np.ones((30, 30), bool), KEEP_ALL).any()


def test_specks_go_by_their_area_and_diagonal_neighbours_are_one_part() -> None:
    ridges = np.zeros((30, 30), bool)
    ridges[2:5, 2:5] = True  # 9 pixels
    ridges[10:13, 10:13] = ridges[13:16, 13:16] = True  # 18, joined by a corner
    p = BinarizationParameters(min_ridge_area_px=10, min_hole_area_px=0)
    kept = binarize(as_enhanced(ridges), whole(ridges), p)
    assert parts(kept) == 1
    assert kept.sum() == 18


def test_pores_are_filled_by_their_area_and_diagonal_gaps_stay_closed() -> None:
    ridges = np.ones((30, 30), bool)
    ridges[5:7, 5:7] = ridges[7:9, 7:9] = False  # two pores of 4 pixels, joined by a corner only
    ridges[20:24, 20:24] = False  # 16 pixels
    p = BinarizationParameters(min_ridge_area_px=0, min_hole_area_px=5)
    filled = binarize(as_enhanced(ridges), whole(ridges), p)
    assert filled[:10, :10].all()
    assert (~filled).sum() == 16


def test_what_lies_outside_the_mask_is_neither_ridge_nor_a_pore() -> None:
    ridges = drawn("#######", "#######", "#######", "#######", "#######")
    mask = whole(ridges)
    mask[2, 3] = False
    p = BinarizationParameters(min_ridge_area_px=0, min_hole_area_px=5)
    assert np.array_equal(binarize(as_enhanced(ridges), mask, p), mask)
    assert not binarize(as_enhanced(ridges), ~whole(ridges), p).any()


@given(
    arrays(np.float32, (20, 24), elements=st.floats(-1, 1, width=32)),
    arrays(np.bool_, (20, 24)),
    st.integers(0, 30),
    st.integers(0, 30),
)
def test_ridges_lie_in_the_mask_and_only_small_parts_change(
    enhanced: np.ndarray, mask: Binary, ridge_area: int, hole_area: int
) -> None:
    p = BinarizationParameters(min_ridge_area_px=ridge_area, min_hole_area_px=hole_area)
    ridges = binarize(enhanced, mask, p)
    assert not (ridges & ~mask).any()
    lost = (enhanced > 0) & mask & ~ridges
    assert parts(lost) * max(ridge_area, 1) >= lost.sum()
    gained = ridges & (enhanced <= 0)
    assert gained.sum() == 0 or hole_area > 1


@given(st.one_of(binaries, blobs), st.integers(0, 1), st.integers(0, 40), st.booleans())
def test_the_kernel_its_twin_and_opencv_turn_over_the_same_parts(
    interpreted: Callable[[str], ModuleType],
    binary: Binary,
    colour: int,
    min_area: int,
    corners: bool,
) -> None:
    oracle, *others = (binary.astype(np.uint8) for _ in range(3))
    flip_with_opencv(oracle, colour, min_area, corners=corners)
    for module, image in zip((kernel, interpreted("_small_parts_kernel")), others, strict=True):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(kernel, "flip_small_parts", module.flip_small_parts)
            flip_with_kernel(image, colour, min_area, corners=corners)
        assert np.array_equal(image, oracle)


def test_a_spiral_and_a_comb_are_one_part_each() -> None:
    comb = np.zeros((30, 41), np.uint8)
    comb[:, ::2] = 1  # many parts until the last row joins them
    comb[-1] = 1
    spiral = np.zeros((41, 41), np.uint8)
    y = x = 20
    for length in range(1, 20):
        for dy, dx in ((0, 1), (1, 0)):
            sign = 1 if length % 2 else -1
            for _ in range(2 * length):
                spiral[y, x] = 1
                y, x = min(max(y + sign * dy, 0), 40), min(max(x + sign * dx, 0), 40)
    for picture in (comb, spiral):
        kept, gone = picture.copy(), picture.copy()
        flip_with_kernel(kept, 1, int(picture.sum()), corners=False)
        flip_with_kernel(gone, 1, int(picture.sum()) + 1, corners=False)
        assert np.array_equal(kept, picture)
        assert not gone.any()

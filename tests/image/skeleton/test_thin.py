"""Ridges without specks and pores, thinned to lines that keep what hangs together."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fpmatch.image.skeleton import _small_parts_kernel
from fpmatch.image.skeleton import thin as module
from fpmatch.image.skeleton.thin import (
    AROUND,
    CROSSING_NUMBER,
    binarize,
    flip_with_opencv,
    thin,
    thin_with_skimage,
)
from tests.image.made_images import extremes_too, holes, parts, plane_wave, shapes


def binarized(ridges, min_ridge_area=0, min_hole_area=0):
    """Binarize +1 where there are ridges and -1 elsewhere, with other least areas."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MIN_RIDGE_AREA_PX", min_ridge_area)
        patch.setattr(module, "MIN_HOLE_AREA_PX", min_hole_area)
        whole = np.ones(ridges.shape, bool)
        return binarize(np.where(ridges, 1, -1).astype(np.float32), whole)


@extremes_too
@given(shapes)
def test_binary_is_the_sign_in_the_mask_without_what_is_smaller_than_the_least_area(ridges):
    assert np.array_equal(binarized(ridges), ridges)
    assert not binarized(ridges, ridges.size + 1).any()
    assert not binarize(np.ones(ridges.shape, np.float32), np.zeros(ridges.shape, bool)).any()


def test_specks_go_and_pores_are_filled_by_their_area():
    ridges = np.zeros((30, 30), bool)
    ridges[2:5, 2:5] = True  # 9 pixels
    ridges[10:13, 10:13] = ridges[13:16, 13:16] = True  # 18, joined by a corner
    kept = binarized(ridges, min_ridge_area=10)
    assert (parts(kept), kept.sum()) == (1, 18)
    ridges[:] = True
    ridges[5:7, 5:7] = ridges[7:9, 7:9] = False  # two pores of 4 pixels, joined by a corner only
    ridges[20:24, 20:24] = False  # 16 pixels
    filled = binarized(ridges, min_hole_area=5)
    assert filled[:10, :10].all()
    assert (~filled).sum() == 16


COMB = np.zeros((14, 15), bool)
COMB[:, ::2] = COMB[-1] = True  # many parts until the last row joins them


@given(shapes, st.integers(0, 1), st.integers(0, 40), st.booleans())
@example(COMB, 1, 119, False)
@example(COMB, 1, 120, False)
def test_the_kernel_and_opencv_turn_over_the_same_parts(binary, colour, min_area, corners):
    oracle, image = binary.astype(np.uint8), binary.astype(np.uint8)
    flip_with_opencv(oracle, colour, min_area, corners=corners)
    runs = np.empty((image.size, 5), np.int32)
    _small_parts_kernel.flip_small_parts(image, colour, min_area, int(corners), runs)
    assert np.array_equal(image, oracle)


def needed(skeleton):
    """Tell whether each pixel is an end, alone, or holds something together: the obvious test."""
    whole = np.pad(skeleton, 1)
    before = parts(whole), holes(whole)
    for y, x in np.argwhere(whole):
        if sum(whole[y + dy, x + dx] for dy, dx in AROUND) >= 2:
            whole[y, x] = False
            if (parts(whole), holes(whole)) == before:
                return False
            whole[y, x] = True
    return True


TWO_LAST_PASSES = np.array([[1, 0, 0, 1, 0, 1, 1, 1], [1, 1, 0, 1, 1, 1, 0, 1], [1] * 7 + [0]])
TWO_LAST_PASSES = np.vstack([TWO_LAST_PASSES, [[1, 1, 1, 0, 1, 0, 1, 1], [1, 1, 0, 1, 1, 0, 0, 1]]])


@extremes_too
@given(shapes)
@example(np.ones((30, 50), bool))
@example(TWO_LAST_PASSES.astype(bool))
def test_the_skeleton_is_thin_connected_as_before_and_final(binary):
    skeleton = thin(binary)
    assert not (skeleton & ~binary).any()
    assert parts(skeleton) == parts(binary)
    assert holes(skeleton) == holes(binary)
    assert needed(skeleton)
    assert np.array_equal(thin(skeleton), skeleton)


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0)])
def test_an_empty_image_is_its_skeleton(shape):
    assert thin(np.ones(shape, bool)).shape == shape


def assert_thin_as_by_skimage(binary):
    other = np.pad(binary, 1).view(np.uint8)
    thin_with_skimage(other)
    assert np.array_equal(thin(binary), other[1:-1, 1:-1])


@given(shapes)
def test_the_kernel_agrees_with_scikit_image(binary):
    assert_thin_as_by_skimage(binary)


@pytest.mark.parametrize("width", [62, 63, 64, 65, 126, 127, 128, 130])
def test_the_kernel_agrees_with_scikit_image_across_words(width, rng):
    for binary in (plane_wave(30, 9, (40, width)) > 0, rng.random((60, width)) < 0.7):
        assert_thin_as_by_skimage(binary)


def test_the_crossing_number_is_half_the_number_of_changes_around_a_pixel():
    for code in range(256):
        around = [code >> k & 1 for k in range(8)]
        assert CROSSING_NUMBER[code] == sum(around[k] != around[k - 1] for k in range(8)) // 2

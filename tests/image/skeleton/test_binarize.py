import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.image.skeleton import _small_parts_kernel as kernel
from fpmatch.image.skeleton import thin as module
from fpmatch.image.skeleton.thin import binarize, flip_small_parts, flip_with_opencv
from tests.image.made_images import extremes_too, parts, plane_wave, shapes


def binarized(ridges, min_ridge_area=0, min_hole_area=0, mask=None):
    """Binarize +1 where there are ridges and -1 elsewhere, with other least areas."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MIN_RIDGE_AREA_PX", min_ridge_area)
        patch.setattr(module, "MIN_HOLE_AREA_PX", min_hole_area)
        whole = np.ones(ridges.shape, bool) if mask is None else mask
        return binarize(np.where(ridges, 1, -1).astype(np.float32), whole)


@extremes_too
@given(shapes)
def test_it_is_the_sign_without_what_is_smaller_than_the_least_area(ridges):
    assert np.array_equal(binarized(ridges), ridges)
    assert not binarized(ridges, ridges.size + 1).any()


@pytest.mark.parametrize("angle", [0, 33, 90])
def test_a_wave_becomes_stripes_of_half_the_ground_and_zero_is_no_ridge(angle):
    wave = plane_wave(angle, 9)
    whole = np.ones(wave.shape, bool)
    ridges = binarize(wave, whole)
    middle = (slice(16, 80), slice(16, 80))
    assert np.array_equal(ridges[middle], wave[middle] > 0)
    assert ridges.mean() == pytest.approx(0.5, abs=0.05)
    assert not binarize(0 * wave, whole).any()


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


@given(shapes, st.integers(0, 1), st.integers(0, 40), st.booleans())
def test_the_kernel_its_twin_and_opencv_turn_over_the_same_parts(
    interpreted, binary, colour, min_area, corners
):
    oracle, *others = (binary.astype(np.uint8) for _ in range(3))
    flip_with_opencv(oracle, colour, min_area, corners=corners)
    for flipping, image in zip((kernel, interpreted("_small_parts_kernel")), others, strict=True):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(kernel, "flip_small_parts", flipping.flip_small_parts)
            patch.setattr(kernel, "COMPILED", True)
            flip_small_parts(image, colour, min_area, corners=corners)
        assert np.array_equal(image, oracle)


def test_a_spiral_and_a_comb_are_one_part_each():
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
        flip_small_parts(kept, 1, int(picture.sum()), corners=False)
        flip_small_parts(gone, 1, int(picture.sum()) + 1, corners=False)
        assert np.array_equal(kept, picture)
        assert not gone.any()

"""Fields of blocks, blurred and brought to pixels and back."""

import cv2
import numpy as np
import pytest

from fpmatch.image.preprocess.arrays import (
    BLOCK_PX,
    block_mean_product,
    blocks_to_pixels,
    blur_blocks,
)


def test_interpolation_is_linear_between_the_centres_of_blocks():
    ramp = np.tile(np.arange(5, dtype=np.float32), (2, 1))
    pixels = blocks_to_pixels(ramp, (16, 37))
    assert pixels.shape == (16, 37)
    between = np.arange(4, 28)
    assert pixels[5, between] == pytest.approx((between + 0.5) / 8 - 0.5, abs=1e-4)
    assert blocks_to_pixels(np.dstack([ramp, ramp]), (16, 37)).shape == (16, 37, 2)


@pytest.mark.parametrize("shape", [(1, 1), (7, 9), (8, 8), (17, 40), (48, 1)])
def test_products_are_averaged_over_blocks_that_repeat_the_edge(rng, shape):
    a, b = rng.normal(0, 1, (2, *shape)).astype(np.float32)
    a.setflags(write=False)
    means = block_mean_product(a, b)
    assert means.dtype == np.float32
    repeated = np.pad(a * b, [(0, -side % BLOCK_PX) for side in shape], mode="edge")
    rows, columns = (side // BLOCK_PX for side in repeated.shape)
    expected = repeated.reshape(rows, BLOCK_PX, columns, BLOCK_PX).mean(axis=(1, 3))
    np.testing.assert_allclose(means, expected, rtol=0, atol=1e-5)
    np.testing.assert_array_equal(block_mean_product(np.asfortranarray(a), b), means)
    at_pixels = blocks_to_pixels(means, shape)
    assert at_pixels.shape == shape
    assert means.min() - 1e-5 <= at_pixels.min() <= at_pixels.max() <= means.max() + 1e-5


@pytest.mark.parametrize("channels", [1, 3, 4, 5, 16])
def test_each_channel_is_blurred_by_itself(rng, channels):
    blocks = rng.random((9, 7, channels), dtype=np.float32)
    blurred = blur_blocks(blocks, 1.2)
    for k in range(channels):
        alone = np.ascontiguousarray(blocks[:, :, k])
        once = cv2.GaussianBlur(alone, (0, 0), 1.2, borderType=cv2.BORDER_REPLICATE)
        np.testing.assert_allclose(blurred[:, :, k], once, rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(blur_blocks(alone, 1.2), once)

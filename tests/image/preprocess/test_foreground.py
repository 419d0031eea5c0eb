"""Nothing of a print is outside, and little else inside."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import concentric_rings, hostile_pictures

from fpmatch.image.preprocess.arrays import Box
from fpmatch.image.preprocess.foreground import (
    ALIGNMENT_PX,
    MARGIN_PX,
    MIN_SIDE_PX,
    WINDOW_PX,
    foreground_box,
)


def page(shape, top, left, noise=0.0):
    """Return a print of 160 by 160 pixels on a white page, or one with some noise."""
    rings = np.clip(128 + 90 * concentric_rings((160, 160), 9), 0, 255)
    paper = np.full(shape, 250.0)
    paper[top : top + 160, left : left + 160] = rings
    grain = np.random.default_rng(7).normal(0, noise, shape) if noise else 0
    return np.clip(paper + grain, 0, 255).astype(np.uint8)


@given(
    arrays(np.uint8, st.tuples(st.integers(1, 120), st.integers(1, 120)))
    | st.sampled_from(list(hostile_pictures().values()))
)
def test_any_image_has_a_box_inside_it(image):
    box = foreground_box(image)
    assert 0 <= box.top < box.bottom <= image.shape[0]
    assert 0 <= box.left < box.right <= image.shape[1]
    assert box.top % ALIGNMENT_PX == box.left % ALIGNMENT_PX == 0
    assert image[box.slices].shape == (box.bottom - box.top, box.right - box.left)


@pytest.mark.parametrize("level", [0, 255])
def test_where_nothing_stands_out_it_is_the_whole_image(level):
    assert foreground_box(np.full((90, 130), level, np.uint8)) == Box(0, 90, 0, 130)


@pytest.mark.parametrize("noise", [0.0, 2.0])
@pytest.mark.parametrize(("top", "left"), [(0, 0), (64, 96), (37, 201), (240, 240)])
def test_the_print_is_inside_and_little_else(top, left, noise):
    box = foreground_box(page((400, 400), top, left, noise))
    room = MARGIN_PX + ALIGNMENT_PX + WINDOW_PX
    for first, start, end in ((top, box.top, box.bottom), (left, box.left, box.right)):
        assert first - room <= start <= first
        assert first + 160 <= end <= first + 160 + room or end == 400


def test_a_speck_is_no_print_and_a_small_print_gets_room():
    picture = page((400, 400), 32, 32)
    picture[380:384, 300:304] = 0
    assert foreground_box(picture) == foreground_box(page((400, 400), 32, 32))
    small = np.full((400, 400), 255, np.uint8)
    small[200:216, 200:216:4] = 0
    box = foreground_box(small)
    assert min(box.bottom - box.top, box.right - box.left) >= MIN_SIDE_PX


def test_what_belongs_to_the_box_is_placed_in_the_image():
    box = Box(16, 48, 32, 80)
    pixels = np.arange(1, 32 * 48 + 1, dtype=np.float32).reshape(32, 48)
    whole = box.uncrop(pixels, (70, 90))
    assert (whole.shape, whole.dtype) == ((70, 90), np.float32)
    assert (whole[box.slices] == pixels).all()
    assert whole.sum() == pixels.sum()
    blocks = box.uncrop(np.ones((2, 3), bool), (70, 90), ALIGNMENT_PX)
    assert blocks.shape == (5, 6)
    assert np.argwhere(blocks)[[0, -1]].tolist() == [[1, 2], [2, 4]]

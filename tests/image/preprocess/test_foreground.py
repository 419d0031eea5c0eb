import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.image.enhancement.enhancers import enhance_by_network
from fpmatch.image.preprocess.arrays import Box, blocks_to_pixels
from fpmatch.image.preprocess.foreground import (
    ALIGNMENT_PX,
    MARGIN_PX,
    MIN_SIDE_PX,
    WINDOW_PX,
    foreground_box,
    segment,
    segment_enhanced,
)
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.preprocess.spectrum import ridge_spectrum
from tests.image.made_images import (
    along_and_across,
    as_picture,
    concentric_rings,
    holes,
    hostile_pictures,
    plane_wave,
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
    part = image[box.slices]
    assert part.shape == (box.bottom - box.top, box.right - box.left)
    whole = box.uncrop(part, image.shape, around=7)
    assert np.array_equal(whole[box.slices], part)
    whole[box.slices] = 7
    assert (whole == 7).all()
    assert foreground_box(np.full_like(image, 9)) == Box(0, len(image), 0, image.shape[1])


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


def at_pixels(blocks, picture):
    return blocks_to_pixels(blocks.astype(np.float32), picture.shape) > 0.5


def masks_of(picture):
    """Return the mask of a picture by its spectrum, on blocks and on pixels."""
    image = normalize(picture)
    blocks = segment(image, ridge_spectrum(image.pixels))
    return blocks, at_pixels(blocks, picture)


def learned_masks_of(picture):
    image = normalize(picture)
    blocks = segment_enhanced(image, enhance_by_network(image.pixels))
    return blocks, at_pixels(blocks, picture)


both_methods = pytest.mark.parametrize("masks", [masks_of, learned_masks_of])


def disc(shape, radius, at=None):
    return np.hypot(*along_and_across(shape, 0, at)) < radius


def print_on_paper(inside, period=9):
    ridges = as_picture(plane_wave(60, period, inside.shape))
    return np.where(inside, ridges, 255).astype(np.uint8)


@both_methods
@pytest.mark.parametrize("shape", [(48, 48), (160, 200)])
@pytest.mark.parametrize("name", hostile_pictures())
def test_without_ridges_the_mask_is_almost_empty(masks, name, shape):
    blocks, pixels = masks(hostile_pictures(shape)[name])
    assert (blocks.dtype, blocks.shape) == (bool, tuple(side // 8 for side in shape))
    assert pixels.shape == shape
    assert blocks.mean() < 0.1


@both_methods
@pytest.mark.parametrize("radius", [60, 90])
def test_a_round_print_on_white_paper(masks, radius):
    inside = disc((240, 260), radius)
    _, found = masks(print_on_paper(inside))
    assert (found & inside).sum() / (found | inside).sum() > 0.85
    assert not (found & ~disc((240, 260), radius + 16)).any()


@both_methods
def test_faint_ridges_are_print_where_all_are_faint_but_not_beside_strong_ones(masks):
    faint = np.rint(200 - 14 * plane_wave(60, 9, (160, 320))).astype(np.uint8)
    if masks is masks_of:
        assert masks(faint)[0].mean() > 0.9
    strong = as_picture(plane_wave(60, 9, (160, 320)))
    _, found = masks(np.where(np.arange(320) < 200, strong, faint).astype(np.uint8))
    assert found[24:-24, :180].all()
    assert not found[:, 240:].any()


@settings(max_examples=25)
@given(arrays(np.uint8, st.tuples(st.integers(48, 90), st.integers(48, 90))))
def test_any_picture_gives_masks_without_holes(picture):
    for masks in (masks_of, learned_masks_of):
        blocks, _ = masks(picture)
        assert not blocks.any() or holes(blocks) == 0

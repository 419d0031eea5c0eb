"""The mask is where the ridges are, in one piece, without holes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_images import (
    along_and_across,
    as_picture,
    concentric_rings,
    holes,
    hostile_pictures,
    parts,
    plane_wave,
)

from fpmatch.image.enhancement.enhancers import enhance_by_network
from fpmatch.image.preprocess.foreground import (
    mask_at_pixels,
    ridge_strength,
    segment,
    segment_enhanced,
)
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.preprocess.spectrum import ridge_spectrum


def masks_of(picture):
    """Return the mask of a picture by its spectrum, on blocks and on pixels."""
    image = normalize(picture)
    blocks = segment(image, ridge_spectrum(image.pixels))
    return blocks, mask_at_pixels(blocks, picture.shape)


def learned_masks_of(picture):
    image = normalize(picture)
    blocks = segment_enhanced(image, enhance_by_network(image.pixels))
    return blocks, mask_at_pixels(blocks, picture.shape)


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


@pytest.mark.parametrize("angle", range(0, 180, 30))
@pytest.mark.parametrize(
    ("masks", "period"),
    [(masks_of, 6), (masks_of, 13), (learned_masks_of, 7), (learned_masks_of, 12)],
)
def test_ridges_from_border_to_border_are_all_print_but_for_corners(masks, angle, period):
    blocks, pixels = masks(as_picture(plane_wave(angle, period, (130, 170))))
    assert blocks.mean() > 0.9
    assert pixels[24:-24].all()
    assert pixels[:, 24:-24].all()


@both_methods
@pytest.mark.parametrize("radius", [60, 90])
def test_a_round_print_on_white_paper(masks, radius):
    inside = disc((240, 260), radius)
    _, found = masks(print_on_paper(inside))
    assert (found & inside).sum() / (found | inside).sum() > 0.85
    assert not (found & ~disc((240, 260), radius + 16)).any()


def test_a_round_print_on_noisy_paper(rng):
    inside = disc((240, 260), 80)
    picture = print_on_paper(inside).astype(float) + rng.normal(-12, 4, inside.shape)
    _, found = masks_of(picture.clip(0, 255).astype(np.uint8))
    assert found[inside].all()
    assert not (found & ~disc((240, 260), 104)).any()


def test_the_centre_of_rings_belongs_to_the_print_and_a_speck_beside_it_does_not():
    _, found = masks_of(as_picture(concentric_rings((200, 200), 9)))
    assert found[100:140, 100:140].all()
    assert holes(found) == 0
    both = disc((240, 360), 90, (110, 120)) | disc((240, 360), 20, (310, 120))
    blocks, found = masks_of(print_on_paper(both))
    assert parts(blocks) == 1
    assert not found[:, 280:].any()


@both_methods
def test_faint_ridges_are_print_where_all_are_faint_but_not_beside_strong_ones(masks):
    faint = np.rint(200 - 14 * plane_wave(60, 9, (160, 320))).astype(np.uint8)
    if masks is masks_of:
        assert masks(faint)[0].mean() > 0.9
    strong = as_picture(plane_wave(60, 9, (160, 320)))
    _, found = masks(np.where(np.arange(320) < 200, strong, faint).astype(np.uint8))
    assert found[24:-24, :180].all()
    assert not found[:, 240:].any()


def test_strength_is_one_for_a_wave_and_little_for_noise(rng):
    wave = ridge_strength(ridge_spectrum(plane_wave(0, 8, (96, 96))))
    noise = ridge_strength(ridge_spectrum(rng.normal(0, 1, (96, 96)).astype(np.float32)))
    assert wave[3:-3, 3:-3].min() > 0.85
    assert noise.max() < 0.5
    assert noise.min() >= 0


def test_the_mask_of_pixels_follows_the_mask_of_blocks():
    blocks = np.zeros((8, 11), bool)
    assert not mask_at_pixels(blocks, (61, 83)).any()
    blocks[2:5, 3:7] = True
    pixels = mask_at_pixels(blocks, (61, 83))
    assert pixels[20:36, 28:52].all()
    assert pixels.sum() == pytest.approx(24 * 32, rel=0.1)
    assert mask_at_pixels(~np.zeros_like(blocks), (61, 83)).all()


@settings(max_examples=25)
@given(arrays(np.uint8, st.tuples(st.integers(48, 90), st.integers(48, 90))))
def test_any_picture_gives_masks_without_holes(picture):
    for masks in (masks_of, learned_masks_of):
        blocks, _ = masks(picture)
        assert not blocks.any() or holes(blocks) == 0

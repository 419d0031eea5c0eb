import numpy as np
import pytest

from fpmatch.image.quality.polarity import (
    background_level,
)
from tests.image.made_images import hostile_pictures


def test_prints_on_white_and_their_negatives(pressed):
    for image in pressed:
        assert background_level(image) == -background_level(255 - image) == 1


def test_a_print_that_fills_its_image_decides_nothing(pressed):
    for image in (*(print_[120:270, 110:270] for print_ in pressed), pressed[0][:1, :1]):
        assert background_level(image) == background_level(255 - image) == 0


def test_a_blot_inside_the_print_is_no_background(pressed):
    blotted = pressed[0][120:270, 110:270].copy()
    blotted[40:100, 40:100] = 0
    assert background_level(blotted) == 0


@pytest.mark.parametrize("ground", [160, 200, 255])
def test_a_grey_background_and_one_of_both_kinds(whorl, rng, ground):
    noisy = np.where(whorl == 255, ground, whorl * 0.8) + rng.normal(0, 2, whorl.shape)
    grey = noisy.clip(0, 255).astype(np.uint8)
    assert background_level(grey) > 0 > background_level(255 - grey)
    assert background_level(np.pad(whorl, ((0, 0), (64, 64)))) == 0


@pytest.mark.parametrize("picture", hostile_pictures().values(), ids=hostile_pictures())
def test_pictures_that_are_no_prints_have_a_level(picture):
    assert -1 <= background_level(picture) <= 1

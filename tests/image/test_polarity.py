"""`fpmatch.image.polarity`: white ridges are noticed, and nothing else is taken for them."""

from __future__ import annotations

import numpy as np
import pytest
from made_images import hostile_pictures
from numpy.typing import NDArray

from fpmatch.image.polarity import PolarityParameters, ridges_are_white


def test_a_print_on_white_and_its_negative(whorl: NDArray[np.uint8]) -> None:
    assert not ridges_are_white(whorl)
    assert ridges_are_white(255 - whorl)


@pytest.mark.parametrize("ground", [160, 200, 255])
def test_a_grey_background_will_do(
    whorl: NDArray[np.uint8], rng: np.random.Generator, ground: int
) -> None:
    noisy = np.where(whorl == 255, ground, whorl * 0.8) + rng.normal(0, 2, whorl.shape)
    grey = noisy.clip(0, 255).astype(np.uint8)
    assert not ridges_are_white(grey)
    assert ridges_are_white(255 - grey)


def test_black_corners_beside_a_white_background_are_none(whorl: NDArray[np.uint8]) -> None:
    turned = np.pad(whorl, ((0, 0), (64, 64)))
    assert not ridges_are_white(turned)


def test_a_print_that_fills_the_picture_is_left_alone() -> None:
    full = np.tile((128 + 100 * np.cos(np.arange(192) * 0.7)).astype(np.uint8), (160, 1))
    assert not ridges_are_white(full)
    assert not ridges_are_white(255 - full)


@pytest.mark.parametrize("name", sorted(hostile_pictures()))
def test_no_print_no_ridges(name: str) -> None:
    assert not ridges_are_white(hostile_pictures()[name])


def test_large_and_tiny_pictures(whorl: NDArray[np.uint8]) -> None:
    sampled = PolarityParameters(max_blocks_px=whorl.size // 4)
    assert ridges_are_white(255 - whorl.repeat(2, axis=0).repeat(2, axis=1), sampled)
    assert not ridges_are_white(np.zeros((15, 300), np.uint8))

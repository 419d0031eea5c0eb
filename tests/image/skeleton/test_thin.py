"""Lines one pixel wide that keep what hangs together; the kernel, its oracle, its tables."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.image.skeleton import _thin_kernel as kernel
from fpmatch.image.skeleton.thin import (
    CROSSING_NUMBER,
    SIMPLE,
    thin,
    thin_with_skimage,
)
from tests.image.made_images import drawn, extremes_too, holes, parts, plane_wave, shapes

# East, then counter-clockwise on screen: the order of the bits of a neighbour byte, as (dy, dx).
AROUND = [(0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1)]


def neighbours(binary, y, x):
    """Return the eight neighbours of a pixel of the padded `binary`."""
    return [bool(binary[y + dy, x + dx]) for dy, dx in AROUND]


def needed(skeleton):
    """Tell whether each pixel is an end, alone, or holds something together: the obvious test."""
    whole = np.pad(skeleton, 1)
    before = parts(whole), holes(whole)
    for y, x in np.argwhere(whole):
        if sum(neighbours(whole, y, x)) >= 2:
            whole[y, x] = False
            if (parts(whole), holes(whole)) == before:
                return False
            whole[y, x] = True
    return True


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0), (1, 1), (1, 20), (20, 1)])
def test_what_is_thin_stays_even_at_the_border(shape):
    assert thin(np.ones(shape, bool)).tolist() == np.ones(shape, bool).tolist()


@extremes_too
@given(shapes)
@example(np.ones((30, 50), bool))
@example(drawn("#  # ###", "## ### #", "####### ", "### # ##", "## ##  #"))  # takes two last passes
def test_the_skeleton_is_thin_connected_as_before_and_final(binary):
    skeleton = thin(binary)
    assert not (skeleton & ~binary).any()
    assert parts(skeleton) == parts(binary)
    assert holes(skeleton) == holes(binary)
    assert needed(skeleton)
    assert np.array_equal(thin(skeleton), skeleton)


def parts_around(around):
    """Count the eight-connected parts among the neighbours of a pixel."""
    block = np.zeros((3, 3), bool)
    for (dy, dx), there in zip(AROUND, around, strict=True):
        block[1 + dy, 1 + dx] = there
    return parts(block)


needs_compiled = pytest.mark.skipif(
    not kernel.COMPILED, reason="this kernel uses C pointers: uncompiled, scikit-image runs"
)


def assert_kernel_agrees_with_skimage(binary):
    other = np.pad(binary, 1).view(np.uint8)
    thin_with_skimage(other)
    assert np.array_equal(thin(binary), other[1:-1, 1:-1])


@needs_compiled
@given(shapes)
def test_the_kernel_agrees_with_scikit_image(binary):
    assert_kernel_agrees_with_skimage(binary)


@needs_compiled
@pytest.mark.parametrize("width", [62, 63, 64, 65, 126, 127, 128, 129, 130, 170])
def test_the_kernel_agrees_with_scikit_image_across_words(width, rng):
    for binary in (plane_wave(30, 9, (40, width)) > 0, rng.random((60, width)) < 0.7):
        assert_kernel_agrees_with_skimage(binary)


@given(arrays(np.uint64, (7, 2)), st.integers(0, 2**64 - 1))
def test_interpreted_the_kernel_leaves_the_same_words(interpreted, random, mask):
    words = np.zeros((9, 4), np.uint64)
    words[1:-1, 1:-1] = random | np.roll(random, 1, axis=0) & np.uint64(mask)
    plain = words.copy()
    for module, image in ((kernel, words), (interpreted("_thin_kernel"), plain)):
        module.thin_words(image, np.zeros_like(image), np.zeros(len(image), np.int32))
    assert np.array_equal(words, plain)


def test_the_tables_agree_with_their_definitions():
    for code in range(256):
        around = [bool(code >> k & 1) for k in range(8)]
        simple = sum(around) >= 2 and parts_around(around) == 1 and not all(around[::2])
        assert SIMPLE[code] == simple
        changes = sum(around[k] != around[k - 1] for k in range(8))
        assert CROSSING_NUMBER[code] == changes // 2

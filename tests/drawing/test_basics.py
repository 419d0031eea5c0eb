import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.drawing.scene.items import directions, moved, parts, text_width, wrapped
from fpmatch.drawing.scene.raster import png_bytes, reduced, webp_bytes
from fpmatch.pointset.geometry.similarity import Similarity


@pytest.mark.parametrize("width", [40.0, 120.0, 400.0])
def test_wrapping_keeps_words_and_width(width):
    text = "no transform brings more than 3 minutiae together"
    lines = wrapped(text, 14.0, width)
    assert " ".join(lines) == text
    assert all(text_width(line, 14.0) <= width or " " not in line for line in lines)
    assert wrapped("  \n ", 14.0, width) == []


def test_signs_that_the_font_lacks_are_spelt():
    assert [letters for letters, *_ in parts("2 × 3\n ≥ −1°", 12.0)] == ["2 x 3 >= -1°"]


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
def test_png_keeps_every_pixel(rng, shape):
    picture = rng.integers(0, 256, shape, dtype=np.uint8)
    stored = cv2.imdecode(np.frombuffer(png_bytes(picture), np.uint8), cv2.IMREAD_UNCHANGED)
    order = {2: slice(None), 3: [2, 1, 0], 4: [2, 1, 0, 3]}[shape[2] if len(shape) > 2 else 2]
    np.testing.assert_array_equal(stored[..., order], picture)


def test_webp_is_nearly_the_picture(rng):
    picture = np.repeat(np.repeat(rng.integers(0, 256, (4, 5, 3), dtype=np.uint8), 16, 0), 16, 1)
    stored = cv2.imdecode(np.frombuffer(webp_bytes(picture, 95), np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(stored[..., ::-1].astype(int) - picture).mean() < 6


@pytest.mark.parametrize(
    ("given", "shown"),
    [((40, 30), (40, 30)), ((100, 50), (50, 25)), ((50, 80), (25, 40)), ((1000, 1), (50, 1))],
)
def test_a_picture_is_reduced_to_fit_and_never_enlarged(given, shown, rng):
    picture = rng.integers(0, 256, (*given, 3), np.uint8)
    small = reduced(picture, width=40, height=50)
    assert small.shape == (*shown, 3)
    assert small.dtype == np.uint8
    if given == shown:
        assert small is picture


transforms = st.builds(
    Similarity, st.floats(0.1, 10), st.floats(-4, 4), st.floats(-500, 500), st.floats(-500, 500)
)


@given(transforms, st.floats(0, 2 * math.pi))
def test_directions_turn_with_the_points(transform, angle):
    matrix = transform.matrix
    step = np.array([[10.0, 10.0], [10 + math.cos(angle), 10 - math.sin(angle)]])
    start, end = transform.apply(step)
    expected = (end - start) / np.linalg.norm(end - start)
    np.testing.assert_allclose(directions(matrix, np.array([angle]))[0], expected, atol=1e-6)


def test_what_lies_absurdly_far_stays_finite():
    far = Similarity(1e300, 1.0, -1e300, 1e308).matrix
    assert np.isfinite(moved(far, [[1e9, -1e9], [0.0, 0.0]])).all()
    assert moved(far, np.empty((0, 2))) == []

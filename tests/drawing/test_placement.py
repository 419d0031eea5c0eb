import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.drawing.scene.items import (
    Box,
    bounds,
    direction_on_page,
    magnification,
    moved,
    of_transform,
    zoomed,
)
from fpmatch.pointset.geometry.similarity import Similarity

transforms = st.builds(
    Similarity, st.floats(0.1, 10), st.floats(-4, 4), st.floats(-500, 500), st.floats(-500, 500)
)


@given(transforms)
def test_points_move_as_the_transform_says(transform):
    points = np.array([[0.0, 0.0], [30.0, -7.0], [100.5, 220.25]])
    np.testing.assert_allclose(moved(of_transform(transform), points), transform.apply(points))
    assert magnification(of_transform(transform)) == pytest.approx(transform.scale)


@given(transforms, st.floats(0, 2 * math.pi))
def test_directions_turn_with_the_points(transform, angle):
    matrix = of_transform(transform)
    step = np.array([[10.0, 10.0], [10 + math.cos(angle), 10 - math.sin(angle)]])
    start, end = transform.apply(step)
    expected = (end - start) / np.linalg.norm(end - start)
    np.testing.assert_allclose(direction_on_page(matrix, angle), expected, atol=1e-6)


def test_zooming_takes_the_origin_where_it_should_go():
    placed = moved(zoomed(3.0, (5.0, 6.0), (100.0, 50.0)), [[5.0, 6.0], [6.0, 8.0]])
    assert placed == [(100.0, 50.0), (103.0, 56.0)]
    half = moved(zoomed(2.0, (-0.5, -0.5), (-0.5, -0.5)), Box(-0.5, -0.5, 20, 10).corners)
    assert bounds(half) == bounds(moved(np.eye(3), Box(-0.5, -0.5, 40, 20).corners))


def test_what_lies_absurdly_far_stays_finite():
    far = of_transform(Similarity(1e300, 1.0, -1e300, 1e308))
    assert np.isfinite(moved(far, [[1e9, -1e9], [0.0, 0.0]])).all()
    assert moved(far, np.empty((0, 2))) == []

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import seeds

from fpmatch.errors import PointSetError
from fpmatch.pointset.paper.parametrize import boundary_angles, shape_preserving_weights

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


@given(seeds, st.integers(3, 9))
def test_weights_are_barycentric_coordinates(seed, degree):
    """In a ring that goes once round its centre, with no gap of half a turn."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(degree) + rng.uniform(-0.2, 0.2, degree)) / degree
    away = rng.uniform(10, 40, degree)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    centre = rng.uniform(-50, 50, 2)
    ring = centre + away
    weights = shape_preserving_weights(ring, centre)
    assert weights.sum() == pytest.approx(1, abs=1e-12)
    assert (weights > 0).all()
    assert weights @ ring == pytest.approx(centre, abs=1e-9)


def test_shape_preserving_weights_by_hand():
    # Through (2, 1), the lines from (0, 0) and (4, 0) leave halfway up the other side; those from
    # (4, 4) and (0, 4) leave by the lower side, a third along.
    lines = [[2, 1, 1, 0], [1, 2, 0, 1], [2, 1, 1, 0], [1, 2, 0, 1]]
    assert shape_preserving_weights(SQUARE, [2, 1]) == pytest.approx(np.mean(lines, axis=0) / 4)
    # The line from (0, 0) through (1, 1) gives the vertex (4, 4) the whole share.
    lines = [[3, 0, 1, 0], [2, 1, 0, 1], [3, 0, 1, 0], [2, 1, 0, 1]]
    assert shape_preserving_weights(SQUARE, [1, 1]) == pytest.approx(np.mean(lines, axis=0) / 4)


def test_boundary_is_spaced_by_chord_length():
    assert np.degrees(boundary_angles([[0, 0], [3, 0], [3, 4]])) == pytest.approx([0, 90, 210])
    with pytest.raises(PointSetError, match="coincide"):
        boundary_angles([[1, 1], [1, 1], [1, 1]])


@pytest.mark.parametrize(
    ("ring", "centre"),
    [
        ([[0, 0], [1, 0]], [0.5, 0.1]),  # too few
        (SQUARE, [5, 2]),  # outside
        (SQUARE, [4, 2]),  # on a side
        (SQUARE, [4, 4]),  # on a corner
        ([[0, 0], [4, 4], [4, 0], [0, 4]], [2, 1]),  # not in order
        (SQUARE + SQUARE, [2, 2]),  # twice round
        ([[0, 0], [np.nan, 0], [0, 1]], [0, 0]),
        (SQUARE, [0, 0, 0]),
    ],
)
def test_rings_that_do_not_go_round_are_refused(ring, centre):
    with pytest.raises(PointSetError):
        shape_preserving_weights(ring, centre)  # type: ignore[arg-type]

"""Neighbourhoods: known small ones, hostile positions, and those of the reference."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import any_points, on_pixels, seeds

from fpmatch.matching.prints.neighbourhood import neighbourhoods
from fpmatch.matching.prints.parameters import NeighbourhoodParameters
from fpmatch.matching.prints.prepared import rounded
from fpmatch.matching.reference import neighbourhood as reference

P = NeighbourhoodParameters()


def minutiae(*rows):
    """Return minutiae (4, N) from rows x, y (up), direction in degrees."""
    x, y, degrees = np.array(rows, float).reshape(-1, 3).T
    return np.ascontiguousarray([x, y, np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])


def test_a_neighbour_stands_in_the_frame_of_its_minutia():
    found = neighbourhoods(minutiae((10, 10, 90), (10, 40, 180), (-10, 10, 90)))
    # From the first minutia, which looks up: 30 px ahead, and 20 px to the left.
    assert found.count.tolist() == [2, 2, 2]
    left, ahead = found.frame[0, :4, :2].T
    assert left == pytest.approx([0, 20, 1, 0], abs=1e-5)
    assert ahead == pytest.approx([30, 0, 0, 1], abs=1e-5)
    precision = [(P.tolerance_px + P.tolerance_per_px * d) ** -2 for d in (20, 30)]
    assert found.frame[0, 4, :2] == pytest.approx(precision)


@given(seeds, st.integers(1, 14), st.floats(0.1, 1))
def test_frames_agree_with_the_reference(seed, size, second):
    points = any_points(seed)
    p = NeighbourhoodParameters(neighbours=size, second_ring_weight=second)
    found = neighbourhoods(points, p)
    expected = reference.neighbourhoods(points, p)
    assert found.frame.shape == (points.shape[1], 6, size)
    assert found.count.tolist() == expected.count.tolist()
    kept = np.arange(size) < found.count[:, None]
    assert found.neighbour[kept].tolist() == expected.neighbour[kept].tolist()
    assert rounded(found).frame == pytest.approx(expected.frame, rel=1e-4, abs=1e-4)


@given(seeds)
def test_crowded_minutiae_keep_every_value_finite(seed):
    points = on_pixels(np.random.default_rng(seed), 40, side=4)
    found = neighbourhoods(points)
    assert np.isfinite(found.frame).all()
    assert (found.frame[:, 4] <= np.float32(P.tolerance_px**-2)).all()

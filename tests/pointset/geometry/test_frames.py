import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, beyond_reach, seeds, similarities

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.frames import UnitFrame, between_sets, frame_of

exponents = st.integers(-280, 280)
offsets = st.sampled_from([0.0, -0.5, 1e3])


def sized(seed, exponent, offset=0.0):
    """Return ten points of extent 2**exponent or a little less, `offset` extents off the origin."""
    points = np.random.default_rng(seed).uniform(0, 1, (10, 2))
    return np.ldexp(points + np.array([offset, -offset]), exponent)


@given(any_finite_points)
def test_the_frame_holds_any_points_in_the_unit_square(points):
    unit = UnitFrame.of(points).apply(points)
    assert unit.shape == points.shape
    assert ((unit >= 0) & (unit < 1)).all()
    assert len(np.unique(points, axis=0)) < 2 or unit.max() >= 0.5
    if beyond_reach(points):
        with pytest.raises(PointSetError, match=r"^points: extent beyond 2\*\*-300$"):
            frame_of(points)
    else:
        assert frame_of(points) == UnitFrame.of(points)


def test_the_frame_is_exact_for_whole_pixels():
    points = np.array([[3.0, 700.0], [388.0, 12.0], [41.0, 1.0]])
    frame = UnitFrame.of(points)
    unit = frame.apply(points)
    assert np.array_equal(np.ldexp(unit, frame.exponent) + points.min(axis=0), points)


@given(
    seeds, similarities(10, 2), exponents, exponents, offsets, st.sampled_from(["p", "q", "", "pq"])
)
def test_between_sets_goes_in_moves_and_comes_out(seed, move, of_p, of_q, offset, without):
    p, q = sized(seed, of_p, offset), sized(seed + 1, of_q, -offset)
    frame_p, frame_q = frame_of(p), frame_of(q)
    if "p" in without:  # a set may need no frame
        p, frame_p = sized(seed, 0), UnitFrame()
    if "q" in without:
        frame_q = UnitFrame()
    there = between_sets(move, frame_p, frame_q).apply(p)
    assert frame_q.apply(there) == pytest.approx(move.apply(frame_p.apply(p)), abs=1e-9)

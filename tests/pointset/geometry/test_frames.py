import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, beyond_reach, seeds, similarities

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.frames import (
    IDENTITY,
    MAX_EXPONENT,
    UnitFrame,
    between_sets,
    frame_if_needed,
    frame_of,
)
from fpmatch.pointset.geometry.points import points_in_box
from fpmatch.pointset.geometry.similarity import Similarity

exponents = st.integers(-MAX_EXPONENT + 20, MAX_EXPONENT - 20)
offsets = st.sampled_from([0.0, -0.5, 1e3])


def in_frame_if_needed(points, name="points"):
    return frame_if_needed(*points_in_box(points), name)


def sized(seed, exponent, offset=0.0):
    """Return ten points of extent 2**exponent or a little less, `offset` extents off the origin."""
    points = np.random.default_rng(seed).uniform(0, 1, (10, 2))
    return np.ldexp(points + np.array([offset, -offset]), exponent)


@pytest.mark.parametrize("in_frame", [frame_of, in_frame_if_needed])
@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 0.0], [2.0**301, 0.0]],
        [[0.0, -(2.0**301)], [1.0, 1.0]],
        [[1e300, 1e300], [1e300, 1e300]],
        [[0.0, 0.0], [2.0**-302, 2.0**-302]],
        [[0.0, 0.0], [0.0, 5e-324]],
    ],
)
def test_what_is_beyond_reach_is_refused_by_name(in_frame, points):
    with pytest.raises(PointSetError, match=r"^their points: .*2\*\*±300$"):
        in_frame(np.array(points), "their points")


@given(any_finite_points)
def test_the_frame_holds_any_finite_points_in_the_unit_square(points):
    unit = UnitFrame.of(points).apply(points)
    assert unit.shape == points.shape
    assert ((unit >= 0) & (unit < 1)).all()
    assert len(np.unique(points, axis=0)) < 2 or unit.max() >= 0.5
    if beyond_reach(points):
        with pytest.raises(PointSetError):
            frame_of(points)
    else:
        assert frame_of(points) == UnitFrame.of(points)


def test_the_frame_is_exact_for_whole_pixels():
    points = np.array([[3.0, 700.0], [388.0, 12.0], [41.0, 1.0]])
    frame = UnitFrame.of(points)
    unit = frame.apply(points)
    assert np.array_equal(np.ldexp(unit, frame.exponent) + points.min(axis=0), points)


@pytest.mark.parametrize(
    "points",
    [
        *(sized(2, 0), sized(2, 59), sized(2, -59), sized(2, 0, offset=1e9)),
        np.array([[0.0, 0.0], [0.0, 1e-9]]),
    ],
)
def test_moderate_points_need_no_frame(points):
    assert in_frame_if_needed(points) is IDENTITY
    assert IDENTITY.apply(points) is points


def test_without_points_or_frame_nothing_moves():
    move = Similarity(2.0, 0.5, 3.0, -1.0)
    assert frame_of(np.empty((0, 2))) == UnitFrame()
    assert UnitFrame().as_similarity() == Similarity()
    assert between_sets(move, IDENTITY, IDENTITY) is move


def test_a_single_place_is_its_own_origin():
    place = np.array([[7.0, -3.0], [7.0, -3.0]])
    assert frame_of(place).apply(place).tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert frame_of(place).as_similarity().apply(place).tolist() == [[0.0, 0.0], [0.0, 0.0]]


@given(seeds, similarities(10, 2), exponents, exponents, offsets, st.sampled_from("pq "))
def test_between_sets_goes_in_moves_and_comes_out(seed, move, of_p, of_q, offset, without):
    p, q = sized(seed, of_p, offset), sized(seed + 1, of_q, -offset)
    frame_p, frame_q = frame_of(p), frame_of(q)
    if without == "p":  # one set may need no frame
        p, frame_p = sized(seed, 0), UnitFrame()
    elif without == "q":
        frame_q = UnitFrame()
    there = between_sets(move, frame_p, frame_q).apply(p)
    assert frame_q.apply(there) == pytest.approx(move.apply(frame_p.apply(p)), abs=1e-9)

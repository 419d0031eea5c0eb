"""What every user of `match_points` relies on, whatever stands behind it."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import (
    any_finite_points,
    beyond_reach,
    check_sound,
    crowded_pixels,
    even_points,
    seeds,
    similarities,
    worn,
)

from fpmatch.errors import PointSetError
from fpmatch.lab.points.match import POINT_MATCHERS, match_points
from fpmatch.lab.points.triangles.matcher import match_by_triangles
from fpmatch.lab.points.van_wamelen.matcher import match_van_wamelen
from fpmatch.pointset.geometry._grid_kernel import COMPILED
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import match_by_unit_circle

every_matcher = pytest.mark.parametrize("matcher", POINT_MATCHERS)

turns = similarities(10, 10)


def check_aligned(match, p, q, within=1e-9):
    """Check that the transform maps P onto Q, point on point, to a share of Q's extent."""
    assert match.transform.apply(p) == pytest.approx(q, abs=within * np.ptp(q, axis=0).max())


@every_matcher
def test_every_matcher_finds_a_moved_copy(matcher):
    p = even_points(1, 20)
    q = Similarity(3.0, -2.0, 50.0, 7.0).apply(p)[::-1]
    match = match_points(p, q, matcher=matcher)
    check_sound(match, p, q)
    check_aligned(match, p, q[::-1])
    assert match.matched_share == 1
    assert match.pairs[:, 1].tolist() == list(range(20))[::-1]
    assert (match.chance is not None) == (matcher == "triangles")
    if matcher == "triangles":  # the default
        default = match_points(p, q)
        assert (match.transform, match.chance) == (default.transform, default.chance)


@pytest.mark.parametrize("name", ["magic", 5])
def test_an_unknown_matcher_is_told_those_there_are(name):
    with pytest.raises(PointSetError, match=rf"{name!r}; known: triangles, paper, van-wamelen$"):
        match_points(even_points(1, 5), even_points(1, 5), matcher=name)


@given(
    seeds,
    st.integers(5, 25),
    st.floats(-math.pi, math.pi),
    st.floats(-100, 100),
    st.sampled_from([0.0, 1.0, -1e3, 1e6, -1e8]),
    st.sampled_from([0.0, -1.0, 1e4, 1e7]),
)
def test_exact_copies_are_recovered_whatever_their_size_and_place(
    seed, n, rotation, magnitude, p_shift, q_shift
):
    # scales of 1e-100 to 1e100: sizes of 1e50 to 1e-50 and the other way round
    base, size = even_points(seed, n), 10 ** (magnitude / 2)
    p = (base + np.array([p_shift, -p_shift])) / size
    q = Similarity(1.0, rotation, q_shift, 0.3 * q_shift).apply(base) * size
    match = match_points(p, q)
    check_aligned(match, p, q, 1e-6)
    assert match.pairs.tolist() == [[i, i] for i in range(n)]
    assert match.rms <= 1e-6 * np.ptp(q)


@given(seeds, turns)
def test_a_worn_copy_is_recognised(seed, move):
    p = even_points(seed, 24)
    q, place = worn(p, move, seed)
    match = match_points(p, q)
    check_sound(match, p, q)
    check_aligned(match, p, move.apply(p), 0.03)
    true = sum(place[i] == j for i, j in match.pairs.tolist())
    assert true >= 18  # of 20
    assert match.chance < 1e-3


def test_p_may_be_the_smaller_or_the_larger():
    p, move = even_points(7, 40), Similarity(2.0, 1.0, 3.0, 4.0)
    part = np.argsort(np.hypot(*(p - 0.5).T))[:20]  # around the middle
    small, large = p[part], move.apply(p)
    match = match_points(small, large)
    check_sound(match, small, large)
    check_aligned(match, small, large[part])
    assert match.pairs.tolist() == [[i, j] for i, j in enumerate(part.tolist())]
    match = match_points(large, small)
    check_sound(match, large, small)
    check_aligned(match, large[part], small)
    assert match.matched_share == 1
    assert match.pairs[:, 0].tolist() == sorted(part.tolist())


@given(seeds, turns)
def test_the_order_of_the_points_does_not_matter(seed, move):
    rng = np.random.default_rng(seed)
    p = even_points(seed, 20)
    q, _ = worn(p, move, seed)
    of_p, of_q = rng.permutation(20), rng.permutation(20)
    one, other = match_points(p, q), match_points(p[of_p], q[of_q])
    there = one.transform.apply(p)
    assert other.transform.apply(p) == pytest.approx(there, abs=1e-9 * np.ptp(there))
    again = {(int(of_p[i]), int(of_q[j])) for i, j in other.pairs.tolist()}
    assert {*map(tuple, one.pairs.tolist())} == again


def test_the_first_of_coincident_points_is_matched():
    base = even_points(9, 20)
    q = Similarity(2.0, 0.3, 5.0, 1.0).apply(np.vstack([base, base[:5]])[::-1])
    match = match_points(np.vstack([base, base]), q)
    check_aligned(match, base, q[:4:-1][:20])
    assert match.pairs.tolist() == [[i, (4 if i < 5 else 24) - i] for i in range(20)]
    assert match.matched_share == 1


BOUNDED = {
    "triangles": partial(match_by_triangles, max_proposals=20_000 if COMPILED else 200),
    "paper": match_by_unit_circle,
    "van-wamelen": partial(
        match_van_wamelen, rho=0.6, lambda_=0.61, max_steps=20_000 if COMPILED else 2_000
    ),
}
"""The matchers themselves, with an end to their work."""

every_search = pytest.mark.parametrize("search", BOUNDED.values(), ids=BOUNDED)


@every_search
@given(p=crowded_pixels, q=crowded_pixels)
def test_crowded_pixels_are_matched_soundly_or_refused(search, p, q):
    try:
        forth, back = search(p, q), search(q, p)
    except PointSetError:
        assert search is BOUNDED["triangles"]  # which refuses points on one line
        return
    check_sound(forth, p, q)
    check_sound(back, q, p)
    if search is BOUNDED["paper"]:
        assert forth.matched_share == back.matched_share


@every_search
@given(p=any_finite_points, q=any_finite_points)
def test_any_finite_points_match_or_are_refused(search, p, q):
    try:
        match = search(p, q)
    except PointSetError:
        assert search is BOUNDED["triangles"] or beyond_reach(p) or beyond_reach(q)
        return
    assert not any(map(beyond_reach, (p, q)))
    assert (match.transform is None) == (len(match.pairs) == 0)


LINES = [np.outer(np.arange(8.0) ** 1.5, to) for to in ((1, 0), (0, 1), (3, 4), (0, 0))]
BAD_SETS = [
    *((even_points(1, count), "fewer than three points: ") for count in range(3)),
    *((line, "all points lie on one line$") for line in LINES),
    *(([[0, 0], [1, 9], [4, bad], [5, 2]], ".*finite") for bad in (math.nan, math.inf, -math.inf)),
    *((np.zeros(shape), "expected an array") for shape in ((5, 3), (6,), (2, 2, 2))),
    ([["a", "b"]], "expected an array"),
    ([[1, 2], [3]], "expected an array"),
]


@every_matcher
@pytest.mark.parametrize(("bad", "reason"), BAD_SETS)
def test_a_bad_set_is_named_with_the_reason(matcher, bad, reason):
    good = even_points(1, 9)
    with pytest.raises(PointSetError, match=f"^p: {reason}"):
        match_points(bad, good, matcher=matcher)
    with pytest.raises(PointSetError, match=f"^q: {reason}"):
        match_points(good, bad, matcher=matcher)


@every_matcher
def test_sizes_and_tolerances_beyond_reach_are_refused(matcher):
    p = even_points(1, 9)
    for size in (1e100, 1e-100):
        with pytest.raises(PointSetError, match="beyond"):
            match_points(p, size * p, matcher=matcher)
    for tolerance in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(PointSetError, match="tolerance"):
            match_points(p, p, matcher=matcher, tolerance=tolerance)


@every_matcher
def test_no_pair_is_farther_than_the_tolerance(matcher):
    p = even_points(4, 20)
    q, _ = worn(p, Similarity(2.0, 0.5, 1.0, 1.0), 4)
    for tolerance in (0.02, 0.08):
        rho = 0.0 if matcher == "paper" else None
        match = match_points(p, q, matcher=matcher, tolerance=tolerance, rho=rho)
        check_sound(match, p, q)
        off = match.transform.apply(p[match.pairs[:, 0]]) - q[match.pairs[:, 1]]
        # the transform is refitted to the pairs at the end, and moves them a little
        assert np.hypot(*off.T).max() < 1.3 * tolerance


@every_matcher
def test_three_points_match_by_no_matcher(matcher):
    p = even_points(1, 3)
    for q in (p * 2, np.vstack([p, even_points(2, 9)])):
        match = match_points(p, q, matcher=matcher)
        assert match.transform is None
        assert "fewer than 4 points" in match.reason


@given(seeds, similarities(10, 10), st.booleans())
def test_a_map_is_found_mirrored_or_not(seed, move, flip):
    p = even_points(seed, 20)
    truth = replace(move, mirrored=flip)
    q, place = worn(p, truth, seed)
    match = match_points(p, q, reflect=True)
    check_sound(match, p, q)
    assert match.transform.mirrored is flip
    size = np.ptp(q, axis=0).max()
    assert match.transform.apply(p) == pytest.approx(truth.apply(p), abs=0.05 * size)
    back = match.transform.inverse().apply(match.transform.apply(p))
    assert back == pytest.approx(p)
    assert sum(place[i] == j for i, j in match.pairs.tolist()) >= 14  # of 16


def test_a_symmetric_set_is_not_mirrored_without_need():
    half = even_points(5, 10) + np.array([0.1, 0.0])
    p = np.vstack([half, half * [-1, 1]])
    match = match_points(p, p, reflect=True)
    assert not match.transform.mirrored
    assert match.matched_share == 1

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import (
    check_sound,
    even_points,
    seeds,
    similarities,
    worn,
)

from fpmatch.lab.points.match import POINT_MATCHERS, match_points
from fpmatch.pointset.geometry.similarity import Similarity


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


@pytest.mark.parametrize("matcher", POINT_MATCHERS)
def test_every_matcher_finds_a_mirrored_copy(matcher):
    p = even_points(4, 25)
    q = Similarity(2.0, 1.0, 5.0, 5.0).apply(p * [-1, 1])
    assert match_points(p, q, matcher=matcher).transform is None
    match = match_points(p, q, matcher=matcher, reflect=True)
    check_sound(match, p, q)
    assert match.transform.mirrored
    assert match.transform.apply(p) == pytest.approx(q)
    assert match.matched_share == 1
    back = match.inverse()
    assert back.transform.apply(q) == pytest.approx(p)
    same = match_points(p * [-1, 1], q, matcher=matcher, reflect=True)
    assert not same.transform.mirrored


def test_a_symmetric_set_is_not_mirrored_without_need():
    half = even_points(5, 10) + np.array([0.1, 0.0])
    p = np.vstack([half, half * [-1, 1]])
    match = match_points(p, p, reflect=True)
    assert not match.transform.mirrored
    assert match.matched_share == 1

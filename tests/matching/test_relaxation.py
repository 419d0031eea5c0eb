"""Relaxation of local matches: the kernel against the reference, and what it is for."""

from collections import namedtuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    any_points,
    seeds,
    similarity_of,
    two_impressions,
)

from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline._kernels import _relaxation_kernel as kernel
from fpmatch.matching.reference.relaxation import Candidates, relax

P = USUAL
MOST = 25
"""Minutiae a side; the candidates support each other in pairs."""

Relaxed = namedtuple("Relaxed", "first second support relaxed strength")
"""Candidates, how well any two of them agree, their relaxed similarities, the mean of the best."""


def relaxation_of(a, b, similarity, p=P, room=3):
    """Return the kernel's relaxation, with room for more minutiae, which must not matter."""
    found = kernel.Relaxation(p, a.shape[1] + room, b.shape[1] + room)
    assert found.load(a, a.shape[1], b, b.shape[1], similarity) == found.count
    return found


def result_of(relaxation):
    n = relaxation.count
    pairs = (np.asarray(side)[:n].tolist() for side in (relaxation.first, relaxation.second))
    support, relaxed = np.array(relaxation.support)[:n, :n], np.array(relaxation.relaxed)[:n]
    return Relaxed(*pairs, support, relaxed, relaxation.strength)


def next_hypothesis(relaxation, size_a, *, whole):
    """Return the number of pairs, partners and weights."""
    partner, weight = np.full(size_a, 77, np.int32), np.full(size_a, np.nan)
    pairs = relaxation.hypothesis(size_a, whole, partner, weight)
    return pairs, partner.tolist(), weight.tolist()


def any_similarity(rng, n, m):
    """Return similarities of which many are 0 and many are equal."""
    return rng.choice(np.float32([0, 0, 0.1, 0.25, 0.5, 0.7, 1.1]), (n, m))


def any_case(seed):
    """Return two prints of one finger or of any, with similarities of their own or random ones."""
    rng = np.random.default_rng(seed)
    a, b = any_points(seed, MOST), any_points(seed + 1, MOST)
    if rng.random() < 0.5:
        a, b = two_impressions(seed, MOST)
    if rng.random() < 0.5:
        return a, b, similarity_of(a, b)
    return a, b, any_similarity(rng, a.shape[1], b.shape[1])


any_parameters = st.builds(
    MatchParameters,
    candidates=st.sampled_from([1, 5, 48]),
    distance_px=st.floats(1, 40),
    max_rotation_deg=st.floats(5, 90),
    max_angle_deg=st.floats(5, 150),
    relaxation_rounds=st.integers(0, 8),
    inertia=st.floats(0, 1),
    least_seed_share=st.floats(0, 1),
    least_share=st.floats(0.01, 1.0),
)


@given(seeds, any_parameters)
def test_relaxation_agrees_with_the_reference(seed, p):
    a, b, similarity = any_case(seed)
    found = result_of(relaxation_of(a, b, similarity, p))
    expected = relax(a, b, similarity, p)
    assert (found.first, found.second) == (expected.first.tolist(), expected.second.tolist())
    assert found.support == pytest.approx(expected.support, abs=1e-9)
    assert found.relaxed == pytest.approx(expected.relaxed, abs=1e-9)
    assert found.strength == pytest.approx(expected.strength, abs=1e-9)


@given(seeds, any_parameters)
def test_hypotheses_agree_with_the_reference(seed, p):
    """Of the candidates that the kernel relaxed, whose last bits decide between equals."""
    a, b, similarity = any_case(seed)
    n = a.shape[1]
    relaxation = relaxation_of(a, b, similarity, p)
    of = result_of(relaxation)
    sides = np.array([of.first, of.second], int)
    candidates = Candidates(similarity, *sides, of.relaxed, of.support, p)
    rng, seeds, whole = np.random.default_rng(seed), candidates.seeds, True
    while seeds:
        partner, weight = candidates.hypothesis(n, seeds[0])
        expected = np.count_nonzero(partner >= 0), partner.tolist(), weight.tolist()
        assert next_hypothesis(relaxation, n, whole=whole) == expected
        # any pairs explain the candidates among them, and no others
        given_pairs = np.where(rng.random(n) < 0.3, -1, partner).astype(np.int32)
        among = candidates.among(given_pairs)
        assert relaxation.explain(given_pairs) == np.count_nonzero(among)
        assert relaxation.support_of(given_pairs) == pytest.approx(of.relaxed[among].sum())
        seeds, whole = [seed for seed in seeds[1:] if not among[seed]], False
    assert next_hypothesis(relaxation, n, whole=False) == (0, [-1] * n, [0.0] * n)

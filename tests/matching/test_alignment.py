"""Global match: known transforms come back, pairs are one to one, skin that bends is followed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    alignments,
    distorted,
    heaviest,
    jittered,
    moved,
    plane,
    seeds,
    similarity_of,
    spread_points,
)

APART = 25.0  # px between minutiae, more than any reach: only true partners can be paired

turns = st.floats(-math.pi, math.pi)
shifts = st.complex_numbers(max_magnitude=300)
scales = st.floats(0.97, 1.03)


def aligned(a, b):
    """Align two prints by their local matches."""
    return heaviest(a, b, similarity_of(a, b))


def matches(n, m, *pairs):
    """Return the similarities of prints of n and m minutiae, of which these alone match."""
    similarity = np.zeros((n, m), np.float32)
    for rank, pair in enumerate(pairs):
        similarity[pair] = 1 - rank / 100
    return similarity


def linear_of(found):
    return found.move[0]


def shift_of(found):
    return found.move[1]


def predicted_by(found):
    """Return the minutiae of A, (4, N), where the mesh of pairs predicts them in B."""
    _, place, direction, _ = found.mesh
    return np.stack([place.real, place.imag, direction.real, direction.imag])


def distances(found, a, b):
    """Return how far apart the paired minutiae lie under the similarity transform alone."""
    i = np.flatnonzero(found.partner >= 0)
    mapped = shift_of(found) + linear_of(found) * plane(a)[i]
    return np.abs(mapped - plane(b)[found.partner[i]])


@given(seeds, turns, shifts, scales)
def test_an_unworn_print_comes_back_exactly(seed, turn, shift, scale):
    a = spread_points(np.random.default_rng(seed), 20, APART)
    b = moved(a, turn, shift, scale)
    found = aligned(a, b)
    assert found.partner.tolist() == list(range(20))
    assert found.weight == pytest.approx(1.0)
    assert predicted_by(found) == pytest.approx(b, abs=1e-6)
    assert linear_of(found) == pytest.approx(scale * np.exp(1j * turn), abs=1e-9)
    assert shift_of(found) == pytest.approx(shift, abs=1e-6)


@given(seeds, turns, shifts, scales)
def test_lost_spurious_and_jittered_minutiae_are_borne(seed, turn, shift, scale):
    rng = np.random.default_rng(seed)
    every = spread_points(rng, 32, APART, size=320.0)
    a = every[:, :26].copy()  # 22 shared, 4 of its own
    kept = np.r_[0:22, 26:32]  # 22 shared, 6 others
    b = jittered(rng, moved(every[:, kept], turn, shift, scale), 1.0, 0.05)
    found = aligned(a, b)
    right = found.partner[:22] == np.arange(22)
    assert right.sum() >= 20
    assert np.count_nonzero(found.partner >= 0) <= right.sum() + 2
    assert abs(np.angle(linear_of(found) * np.exp(-1j * turn))) < np.radians(1.5)
    assert abs(linear_of(found)) == pytest.approx(scale, abs=0.02)
    off = predicted_by(found)[:2, :22] - moved(a, turn, shift, scale)[:2, :22]
    assert np.sqrt((off**2).sum(axis=0).mean()) < 2.5


def test_true_matches_win_over_false_ones():
    """False matches, each with a motion of its own, fade; three true ones support each other."""
    a = spread_points(np.random.default_rng(7), 20, APART)
    b = moved(a, 2.0, 40 - 80j)
    false = [(i, (i + 7) % 20) for i in range(10)]
    true = [(17, 17), (18, 18), (19, 19)]
    for place in (0, 5, 10):
        found = heaviest(a, b, matches(20, 20, *false[:place], *true, *false[place:]))
        assert found.partner.tolist() == list(range(20))


def test_prints_that_agree_in_two_ways_have_two_hypotheses():
    """Two parts of a print that moved apart, as where a finger rolls between two touches."""
    rng = np.random.default_rng(14)
    a = spread_points(rng, 24, APART, size=360.0)
    left = a[0] < np.median(a[0])
    b = np.where(left, moved(a, 0.3, 40j), moved(a, -0.6, 150 + 90j)).copy()
    found = alignments(a, b, np.eye(24, dtype=np.float32))
    assert len(found) >= 2
    everyone = np.arange(24)
    shares = [[(one.partner == everyone)[side].mean() for side in (left, ~left)] for one in found]
    assert max(share[0] for share in shares) > 0.8
    assert max(share[1] for share in shares) > 0.8


@given(seeds, turns, turns)
def test_pairs_are_found_where_the_skin_is_distorted(seed, towards, turn):
    """By 14 px within 60 px, which no similarity transform follows, but the mesh does."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, 40)
    b = jittered(rng, moved(distorted(a, towards), turn, 30 + 10j), 1.0, 0.05)
    found = aligned(a, b)
    assert found.partner.tolist() == list(range(40))
    after_mesh = np.hypot(*(predicted_by(found)[:2] - b[:2]))
    assert np.median(after_mesh) < 0.7 * np.median(distances(found, a, b))


@pytest.mark.parametrize(("n", "m"), [(5, 5), (0, 5), (5, 0), (0, 0)])
def test_no_match_no_alignment(n, m):
    a, b = (spread_points(np.random.default_rng(1), k) for k in (n, m))
    assert alignments(a, b, matches(n, m)) == []


def test_coincident_minutiae_pair_by_their_directions():
    angle = np.radians([0, 90, 180, 270])
    a = np.ascontiguousarray([np.full(4, 50.0), np.full(4, -50.0), np.cos(angle), np.sin(angle)])
    b = moved(a, math.pi / 2, 100.0 + 0j)[:, [2, 0, 3, 1]].copy()
    found = heaviest(a, b, matches(4, 4, (0, 1)))
    assert found.partner.tolist() == [1, 3, 0, 2]
    assert np.angle(linear_of(found)) == pytest.approx(math.pi / 2)
    single = heaviest(a[:, :1].copy(), b[:, 1:2].copy(), matches(1, 1, (0, 0)))
    assert single.partner.tolist() == [0]
    assert predicted_by(single) == pytest.approx(b[:, 1:2])

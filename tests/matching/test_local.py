"""Local match: the kernel against its definition and its numpy form, and what similarity means."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import seeds

from fpmatch.matching.parameters import MatchParameters
from fpmatch.matching.pipeline._kernels import _local_kernel as kernel
from fpmatch.matching.prints.prepared import Neighbourhoods
from fpmatch.matching.reference.neighbourhood import local_similarity

TOLERANCE = MatchParameters(tolerance_px=9.0, tolerance_per_px=0.08)
NARROWEST_PX, WIDEST_PX = 7.5, 15.0


def similarity_from_the_definition(count_a, frame_a, count_b, frame_b, min_cosine):
    """Return what the kernel computes, a pair of minutiae at a time, all neighbours at once."""
    similarity = np.zeros((len(count_a), len(count_b)))
    for i, n in enumerate(count_a):
        u, v, c, s, precision, weight = frame_a[i, :, :n, None].astype(float)
        for j, m in enumerate(count_b):
            u_b, v_b, c_b, s_b, _, weight_b = frame_b[j, :, None, :m].astype(float)
            near = 1 - ((u - u_b) ** 2 + (v - v_b) ** 2) * precision
            turn = (c * c_b + s * s_b - min_cosine) / (1 - min_cosine)
            value = np.maximum(near, 0) * np.maximum(turn, 0) * weight_b
            similarity[i, j] = (value.max(axis=1, initial=0) * weight[:, 0]).sum()
    return similarity


def some_frames(rng, n, size, reach):
    """Return counts and frames of n minutiae whose neighbours lie within `reach` of them."""
    angle = rng.uniform(0, 2 * np.pi, (n, size))
    u, v = rng.uniform(-reach, reach, (2, n, size))
    tolerance = rng.uniform(NARROWEST_PX, WIDEST_PX, (n, size))
    columns = (u, v, np.cos(angle), np.sin(angle), tolerance**-2, rng.uniform(0, 2, (n, size)))
    frame = np.ascontiguousarray(np.stack(columns, axis=1), np.float32)
    return rng.integers(0, size + 1, n).astype(np.int32), frame


def one_neighbourhood(places):
    """Return the neighbourhood of a single minutia: neighbours of equal weight, all looking +u."""
    n = len(places)
    precision = (TOLERANCE.tolerance_px + TOLERANCE.tolerance_per_px * abs(places)) ** -2
    columns = places.real, places.imag, np.ones(n), np.zeros(n), precision, np.ones(n)
    frame = np.array([columns], np.float32)
    return Neighbourhoods(np.array([n], np.int32), np.zeros((1, n), np.int32), frame)


def indexed_similarity(a, b, p, *, by_a):
    """Return what the kernel finds by an index of A's neighbours, or of B's."""
    similarity = np.full((len(a[0]), len(b[0])), np.nan, np.float32)
    index = kernel.NeighbourIndex(*(a if by_a else b), p)
    other = b if by_a else a
    index.to_prints(*other, len(other[0]), similarity, not by_a)
    return similarity


@given(seeds, st.sampled_from([5.0, 20.0, 200.0]), st.floats(1, 90), st.integers(1, 9))
def test_kernel_agrees_with_its_definition(seed, reach, degrees, fewest):
    """Whichever print is indexed, to the last bit; of which neighbours lie beyond the cells."""
    rng = np.random.default_rng(seed)
    # with the slack of this growth the widest tolerance suffices where the narrowest is indexed
    p = MatchParameters(tolerance_per_px=0.5, neighbour_turn_deg=degrees, fewest_neighbours=fewest)
    a, b = (some_frames(rng, int(rng.integers(0, 8)), 9, reach) for _ in range(2))
    expected = similarity_from_the_definition(*a, *b, p.neighbour_cosine)
    sizes = (np.maximum(side[0], fewest) for side in (a, b))
    expected /= np.sqrt(np.multiply.outer(*sizes))
    found = indexed_similarity(a, b, p, by_a=True)
    assert found == pytest.approx(expected, abs=1e-5)
    assert indexed_similarity(a, b, p, by_a=False).tolist() == found.tolist()


@pytest.mark.parametrize("lost", range(5))
def test_lost_and_spurious_neighbours_cost_their_own_weight_alone(lost):
    n = 8
    places = np.array([60 * np.exp(2j * np.pi * k / n) for k in range(n)])
    whole, worn = one_neighbourhood(places), one_neighbourhood(places[lost:])
    expected = (n - lost) / math.sqrt(n * (n - lost))
    assert local_similarity(whole, worn).item() == pytest.approx(expected, abs=1e-6)
    assert local_similarity(worn, whole).item() == pytest.approx(expected, abs=1e-6)
    extra = 200 * np.exp(2j * np.pi * np.arange(lost) / 5)
    more = one_neighbourhood(np.concatenate([extra, places]))
    expected = math.sqrt(n / (n + lost))
    assert local_similarity(whole, more).item() == pytest.approx(expected, abs=1e-6)

"""Bit descriptors: the kernels agree with the reference, whichever print comes first."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from matching_prints import (
    any_points,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
    two_impressions,
)

from fpmatch.matching.constants.prints import MAX_ENCODED, NOWHERE
from fpmatch.matching.prints.prepare import prefilter_of, prepare, score_descriptors
from fpmatch.matching.reference.prefilter import descriptor_similarity


def impressions(seed):
    """Return impressions of one finger and of others, with and without ridges."""
    sides = [
        *two_impressions(seed),
        any_points(seed + 1),
        # a cell has one word however many neighbours are in it; those far away have none
        np.array([[0, 40, 41, 42], [0, 3, 4, 5], [1, 1, 1, 1], [0, 0, 0, 0]], float),
        np.array([[0, 140.0, 0], [0, 0, 135.0], [1, 1, 1], [0, 0, 0]]),
    ]
    flows = (striped_field(orientation=0.3), striped_field(orientation=1.9), None)
    return [template_of(side, field=flows[k % 3]) for k, side in enumerate(sides)]


def assert_same_both_ways(a, b):
    """Hold the scores of two prints equal, whichever is in the tables, and to the reference."""
    expected = descriptor_similarity(a, b)
    assert score_descriptors(prefilter_of(a), b) == expected
    tables = prefilter_of(a)
    tables.load(b.xy, b.direction_bin, b.neighbour_bits, b.orientation_bins, b.has_flow)
    arrays = a.xy, a.direction_bin, a.neighbour_bits, a.orientation_bins, a.has_flow
    assert tables.score(0, len(a.xy), *arrays, True) == expected


@given(seeds, templates())
def test_prints_have_in_common_what_the_reference_finds(seed, any_template):
    """Whichever print is in the tables, and whatever was in them before."""
    prints = [prepare(one).bit_descriptors for one in (*impressions(seed), any_template)]
    for a, b in product(prints, prints):
        assert_same_both_ways(a, b)


@pytest.mark.parametrize("n", [0, 1, 65, 130])
def test_crowds_are_compared_by_their_best(n):
    rng = np.random.default_rng(n)
    quality = rng.integers(1, 100, n)
    points = spread_points(rng, n, 9.0, 400.0)
    crowd = prepare(template_of(points, size=500, quality=quality)).bit_descriptors
    coded = (crowd.neighbour_bits != NOWHERE).any(axis=1)
    assert coded.sum() <= MAX_ENCODED
    if n > MAX_ENCODED:
        assert quality[coded].min() >= np.sort(quality)[-MAX_ENCODED]
        assert score_descriptors(prefilter_of(crowd), crowd) > 100
    few = prepare(template_of(spread_points(rng, 30), size=500)).bit_descriptors
    assert_same_both_ways(crowd, few)
    assert_same_both_ways(crowd, crowd)

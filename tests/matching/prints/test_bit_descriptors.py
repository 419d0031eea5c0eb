"""Bit descriptors: the kernels agree with the reference, whichever print comes first."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from matching_prints import (
    COMPILED,
    impressions_of_a_finger,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.matching.constants.prints import MAX_ENCODED, NOWHERE
from fpmatch.matching.prints.bit_descriptors import (
    prefilter,
    prefilter_of,
    score_descriptors,
)
from fpmatch.matching.prints.parameters import BitDescriptorParameters
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.reference.prefilter import descriptor_similarity

EXAMPLES = 20 if COMPILED else 4
PRINT_SIZE = 14 if COMPILED else 8
P = BitDescriptorParameters()


def impressions(seed):
    """Return impressions of one finger and of others, with and without ridges."""
    sides = [
        *impressions_of_a_finger(seed, PRINT_SIZE),
        # a cell has one word however many neighbours are in it; those far away have none
        np.array([[0, 40, 41, 42], [0, 3, 4, 5], [1, 1, 1, 1], [0, 0, 0, 0]], float),
        np.array([[0, 140.0, 0], [0, 0, 135.0], [1, 1, 1], [0, 0, 0]]),
    ]
    flows = (striped_field(orientation=0.3), striped_field(orientation=1.9), None)
    return [prepare(template_of(side, field=flows[k % 3])) for k, side in enumerate(sides)]


def load(tables, own):
    bits = own.neighbour_bits, own.orientation_bins
    tables.load(own.xy, own.direction_bin, *bits, own.has_flow)


def score(tables, other, *, swapped=False):
    arrays = other.xy, other.direction_bin, other.neighbour_bits, other.orientation_bins
    return tables.score(0, len(other.xy), *arrays, other.has_flow, swapped)


def assert_same_both_ways(a, b):
    tables = prefilter()
    load(tables, a)
    one_way = score(tables, b)
    load(tables, b)
    assert one_way == score(tables, a, swapped=True) == score_descriptors(prefilter_of(a), b) >= 0


@given(seeds)
@settings(max_examples=EXAMPLES)
def test_prints_have_in_common_what_the_reference_finds(seed):
    """Whichever print is in the tables, and whatever was in them before."""
    prints, tables = impressions(seed), prefilter()
    for a, b in product(prints, prints):
        expected = descriptor_similarity(a.bit_descriptors, b.bit_descriptors)
        assert score_descriptors(prefilter_of(a.bit_descriptors), b.bit_descriptors) == expected
        for own, other, swapped in ((a, b, False), (b, a, True)):
            load(tables, own.bit_descriptors)
            assert score(tables, other.bit_descriptors, swapped=swapped) == expected


@given(templates(), templates())
@settings(max_examples=EXAMPLES)
def test_any_templates_have_something_or_nothing_in_common(one, other):
    assert_same_both_ways(*(prepare(template).bit_descriptors for template in (one, other)))


@pytest.mark.parametrize("n", [0, 1, 65, 130])
def test_crowds_are_compared_by_their_best(n):
    size = n if COMPILED else min(n, 70)
    rng = np.random.default_rng(n)
    quality = rng.integers(1, 100, size)
    points = spread_points(rng, size, 9.0, 400.0)
    crowd = prepare(template_of(points, size=500, quality=quality)).bit_descriptors
    few = prepare(template_of(spread_points(rng, 30), size=500)).bit_descriptors
    coded = (crowd.neighbour_bits != NOWHERE).any(axis=1)
    assert coded.sum() <= MAX_ENCODED
    if size > MAX_ENCODED:
        assert quality[coded].min() >= np.sort(quality)[-MAX_ENCODED]
        assert score_descriptors(prefilter_of(crowd), crowd) > 100
    for a, b in ((crowd, few), (crowd, crowd)):
        assert_same_both_ways(a, b)

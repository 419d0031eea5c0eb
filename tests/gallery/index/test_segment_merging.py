"""Segments are merged, and prints are taken from them, as if they were built of these prints."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch import Minutiae, Template
from fpmatch.gallery.index.segment import Segment
from fpmatch.matching.matchers.unit_circle import MATCHER


def scattered(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(0, 25))
    x, y = rng.uniform(20, 280, (2, count))
    return MATCHER.prepare(Template(Minutiae(x, y, rng.uniform(0, 6, count)), 300, 300))


PRINTS = [scattered(seed) for seed in range(12)]
NUMBERS = np.cumsum(np.arange(1, 13))


def built(places):
    which = np.array(places, np.int64)
    return Segment.build(NUMBERS[which], -NUMBERS[which], [PRINTS[k] for k in which])


def same(one, other):
    pairs = zip(one.arrays().values(), other.arrays().values(), strict=True)
    return all(a.dtype == b.dtype and np.array_equal(a, b) for a, b in pairs)


WHOLE = built(range(12))


@given(st.sets(st.integers(0, 11)))
def test_taken_prints_are_those_of_a_segment_built_of_them(which):
    places = np.array(sorted(which), np.int64)
    assert same(WHOLE.take(places), built(places))


@given(st.lists(st.integers(0, 12), max_size=4))
def test_merged_segments_are_one_built_of_all_prints(ends):
    ends = [0, *sorted(ends), 12]
    parts = [built(range(*pair)) for pair in pairwise(ends)]
    assert same(Segment.concatenate(parts), WHOLE)

"""Packed bit descriptors: the prefilter's scores to the last bit, in few bytes, never misread."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    even_field,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.descriptor_scores import prefilter_scores
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.prints.stored_descriptors import StoredDescriptors
from fpmatch.matching.matchers.unit_circle import MATCHER

NO_WORD = 0x8800


def whole_pixels(n, seed=0, dpi=500.0, field=None, size=300.0):
    """Return a prepared print of n minutiae at whole pixels, as galleries contain them."""
    points = spread_points(np.random.default_rng(seed), n, 9.0, size)
    points[:2] = np.rint(points[:2])
    return MATCHER.prepare(template_of(points, dpi, field=field, size=int(size)))


def some_prints(sizes=(12, 0, 3, 25, 2, 70)):
    fields = None, even_field(side=9), striped_field(side=8)
    return [whole_pixels(n, k, (500.0, 1000.0)[k % 2], fields[k % 3]) for k, n in enumerate(sizes)]


def assert_same_scores(packed, prints, probes):
    many = PreparedPrints.pack(prints)
    for probe in probes:
        expected = prefilter_scores(probe, many)
        assert packed.scores(probe).tolist() == expected.tolist()


def test_scores_of_whole_pixels_are_those_of_the_prefilter():
    prints = some_prints()
    packed = StoredDescriptors.pack(prints)
    assert_same_scores(packed, prints, prints)
    assert packed.size.tolist() == [len(one) for one in prints]
    assert packed.scores(prints[3])[3] > 0


@given(templates(), st.lists(templates(), max_size=3))
def test_any_print_comes_back_with_rounded_positions(probe, references):
    prints = [MATCHER.prepare(template) for template in [*references, probe]]
    packed = StoredDescriptors.pack(prints)
    for k, print_ in enumerate(prints):
        expected, found = print_.bit_descriptors, packed[k]
        counts = (expected.neighbour_bits & NO_WORD) != NO_WORD
        kept = counts.any(axis=1)
        step = 2.0 ** packed.step[k]
        assert step == 1 or np.ptp(expected.xy[kept], axis=0).max() >= 511 * step
        beyond = np.abs(expected.xy).max(initial=0) * 1e-6
        assert (np.abs(found.xy - expected.xy[kept]) <= step / 2 + beyond).all()
        assert found.direction_bin.tolist() == expected.direction_bin[kept].tolist()
        assert found.orientation_bins.tolist() == expected.orientation_bins[kept].tolist()
        assert found.has_flow == expected.has_flow
        for row, words, used in zip(
            found.neighbour_bits, expected.neighbour_bits[kept], counts[kept], strict=True
        ):
            assert sorted(row[: used.sum()]) == sorted(words[used])
            assert (row[used.sum() :] == NO_WORD).all()
    assert len(packed.scores(prints[-1])) == len(prints)


def test_any_content_gives_scores_or_is_refused(rng):
    """Whatever the bytes are, no kernel leaves an array."""
    prints = some_prints((12, 25, 40))
    packed = StoredDescriptors.pack(prints)
    refused = 0
    for _ in range(60 if COMPILED else 6):
        content = packed.content.copy()
        places = rng.integers(0, len(content), rng.integers(1, len(content)))
        content[places] = rng.integers(0, 2**32, len(places))
        damaged = StoredDescriptors.of_arrays(packed.arrays() | {"content": content})
        try:
            assert (damaged.scores(prints[1]) >= 0).all()
        except MatcherError:
            refused += 1
    assert refused

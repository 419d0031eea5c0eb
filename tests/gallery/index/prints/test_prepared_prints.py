"""Many prepared prints: each comes back as it was; they are joined, and taken."""

import numpy as np
import pytest
from extreme_prints import extreme_templates
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import SIZES, some_templates, template_of, templates

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.prepared_prints import PRINTS_AT_ONCE, PreparedPrints
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.parameters import MatchParameters
from fpmatch.matching.prints.prepare import prepare


def some_prints(sizes):
    return [*map(MATCHER.prepare, some_templates(sizes))]


def listed_of(n):
    """Return what a print keeps of its minutiae's neighbours."""
    listed = np.arange(n.frame.shape[2]) < n.count[:, None]
    return n.count, n.neighbour[listed], n.frame[np.broadcast_to(listed[:, None], n.frame.shape)]


def parts_of(print_):
    """Return all of a prepared print: values, and arrays with their types."""
    region, bits = print_.region, print_.bit_descriptors
    arrays = print_.points, print_.quality, print_.index, region.code, region.ridges
    arrays += bits.xy, bits.direction_bin, bits.neighbour_bits, bits.orientation_bins
    arrays += listed_of(print_.neighbourhoods)
    values = print_.key, print_.to_500dpi, bits.has_flow, region.has_flow, region.step
    typed = [None if array is None else (array.dtype, array.tolist()) for array in arrays]
    return (*values, region.first_row, region.first_column, *typed)


def assert_same(found, expected):
    assert parts_of(found) == parts_of(expected)


def assert_all_same(found, expected):
    assert len(found) == len(expected)
    for k, print_ in enumerate(expected):
        assert_same(found[k], print_)


@given(st.lists(templates(), max_size=4))
def test_any_prints_come_back_as_they_were(given_):
    prints = [MATCHER.prepare(template) for template in given_]
    assert_all_same(PreparedPrints.pack(prints), prints)


def test_more_prints_than_are_packed_at_once():
    print_ = some_prints((3,))[0]
    many = PreparedPrints.pack(print_ for _ in range(PRINTS_AT_ONCE + 2))
    assert len(many) == PRINTS_AT_ONCE + 2
    assert_same(many[PRINTS_AT_ONCE + 1], print_)


@given(extreme_templates())
def test_what_is_within_the_bounds_can_be_kept_and_packed(template):
    """So nothing that passes at enrolment can make a later search fail."""
    prepared = MATCHER.prepare(unpack_template(pack_template(template)))
    assert PreparedPrints.pack([prepared])[0].key == prepared.key
    assert np.isfinite(MATCHER.compare(prepared, prepared).similarity)


def arrays_of(packed):
    arrays = packed.arrays().items()
    return {name: (array.dtype, array.shape, array.tobytes()) for name, array in arrays}


@pytest.mark.parametrize("sizes", [(), (0,), SIZES])
def test_parts_and_chosen_prints_are_those_of_the_whole(sizes):
    prints = some_prints(sizes)
    whole = PreparedPrints.pack(prints)
    parts = [PreparedPrints.pack(part) for part in (prints[:2], [], prints[2:])]
    assert arrays_of(PreparedPrints.concatenate(parts)) == arrays_of(whole)
    which = [k for k in (3, 3, 0, 1, 4) if k < len(sizes)]
    taken = whole.take(np.array(which, np.intp))
    assert arrays_of(taken) == arrays_of(PreparedPrints.pack([prints[k] for k in which]))
    for outside in (-1, len(sizes), 99):
        with pytest.raises(IndexError, match=f"of {len(sizes)}"):
            whole[outside]


def test_more_minutiae_than_a_byte_can_number_are_refused():
    points = np.zeros((4, 300))
    points[0], points[2] = np.arange(300) * 7.0, 1
    beyond = MatchParameters()
    object.__setattr__(beyond, "max_minutiae", 300)  # out of range
    with pytest.raises(MatcherError, match="300"):
        PreparedPrints.pack([prepare(template_of(points), beyond)])

"""Many prepared prints: each comes back as it was, from memory and from a file, or is refused."""

import numpy as np
import pytest
from extreme_prints import extreme_templates
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    some_templates,
    spread_points,
    template_of,
    templates,
)

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.prepared_prints import PRINTS_AT_ONCE, PreparedPrints
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.matchers.unit_circle import MATCHER


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


@pytest.mark.parametrize("columns", [2**31 - 1, 2**24 + 1])
def test_rows_of_no_cells_are_bounded(columns):
    """None of them is in the file, but a kernel adds to their number."""
    many = PreparedPrints.pack(
        [MATCHER.prepare(template_of(spread_points(np.random.default_rng(1), 0)))]
    )
    nothing = {"cell": many.cell[:0], "ridges": many.ridges[:0], "inside": many.inside * 0}
    nothing |= {"cell_start": many.cell_start * 0, "shape": np.array([[0, 3, 0, 0]], np.int32)}
    assert len(PreparedPrints.of_arrays(many.arrays() | nothing)) == 1
    nothing["shape"] = np.array([[0, columns, 0, 0]], np.int32)
    with pytest.raises(MatcherError):
        PreparedPrints.of_arrays(many.arrays() | nothing)


def test_starts_whose_differences_overflow_are_refused():
    many = PreparedPrints.pack(some_prints((12, 9, 4)))
    for name in ("minutiae_start", "cell_start"):
        starts = getattr(many, name).copy()
        starts[1:3] = 2**63 - 1, -(2**63) + starts[-1] + 1
        with pytest.raises(MatcherError):
            PreparedPrints.of_arrays(many.arrays() | {name: starts})


@given(extreme_templates())
def test_what_is_within_the_bounds_can_be_kept_and_packed(template):
    """So nothing that passes at enrolment can make a later search fail."""
    prepared = MATCHER.prepare(unpack_template(pack_template(template)))
    assert PreparedPrints.pack([prepared])[0].key == prepared.key
    assert np.isfinite(MATCHER.compare(prepared, prepared).similarity)

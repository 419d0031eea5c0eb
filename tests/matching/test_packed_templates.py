"""Many prepared prints: each comes back as it was, from memory and from a file, or is refused."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    even_field,
    ridge_correlation,
    spread_points,
    striped_field,
    template_of,
    templates,
)
from packed_cases import assert_damaged, crowd, from_file

from fpmatch.errors import MatcherError
from fpmatch.matching.packed_templates import COLUMNS, PRINTS_AT_ONCE, PackedTemplates
from fpmatch.matching.pipeline.alignment import identity_alignment
from fpmatch.matching.prepare import prepare

EXAMPLES = 40 if COMPILED else 10


def some_prints(sizes=(12, 0, 3, 25, 2)):
    """Return prints of so many minutiae, with and without a field, and one with its ridges."""
    found = []
    for k, n in enumerate(sizes):
        points = spread_points(np.random.default_rng(k), n)
        quality = np.random.default_rng(k).integers(0, 101, n)
        field = (None, even_field(side=9), striped_field(side=8))[k % 3]
        found.append(prepare(template_of(points, (500.0, 1000.0)[k % 2], quality, field)))
    return found


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
    """Hold two prepared prints to being equal to the last bit."""
    assert parts_of(found) == parts_of(expected)


def assert_all_same(found, expected):
    assert len(found) == len(expected)
    for k, print_ in enumerate(expected):
        assert_same(found[k], print_)


@given(st.lists(templates(), max_size=4))
@settings(max_examples=EXAMPLES)
def test_any_prints_come_back_as_they_were(given_):
    prints = [prepare(template) for template in given_]
    assert_all_same(PackedTemplates.pack(prints), prints)


def test_joined_parts_are_one_after_the_other():
    prints = some_prints()
    parts = map(PackedTemplates.pack, (prints[:2], [], prints[2:]))
    assert_all_same(PackedTemplates.concatenate(list(parts)), prints)
    assert len(PackedTemplates.concatenate([])) == 0


@given(st.lists(st.integers(0, 4), max_size=8))
@settings(max_examples=EXAMPLES)
def test_some_are_taken_in_any_order(which):
    prints = some_prints()
    taken = PackedTemplates.pack(prints).take(np.array(which, np.intp))
    assert_all_same(taken, [prints[place] for place in which])


def test_more_prints_than_are_packed_at_once():
    print_ = some_prints((3,))[0]
    many = PackedTemplates.pack(print_ for _ in range(PRINTS_AT_ONCE + 2))
    assert len(many) == PRINTS_AT_ONCE + 2
    assert_same(many[PRINTS_AT_ONCE + 1], print_)


def test_a_print_of_forty_minutiae_takes_less_than_eight_kilobytes():
    n = 40 if COMPILED else 20
    points = spread_points(np.random.default_rng(2), n)
    many = PackedTemplates.pack([prepare(template_of(points, field=striped_field(side=22)))] * 10)
    assert many.nbytes / len(many) <= 8000
    assert many.nbytes == sum(getattr(many, f.name).nbytes for f in dataclasses.fields(many))


def test_more_minutiae_than_a_byte_can_number_are_refused():
    with pytest.raises(MatcherError, match="300 minutiae"):
        PackedTemplates.pack([crowd()])
    few = crowd(6)
    assert PackedTemplates.pack([few])[0].index.tolist() == few.index.tolist()


@pytest.mark.parametrize("k", [-1, 5, 99])
def test_there_is_no_print_beyond_the_last(k):
    with pytest.raises(IndexError, match="of 5"):
        PackedTemplates.pack(some_prints())[k]


@pytest.mark.parametrize("sizes", [(), (0,), (12, 0, 3, 25, 2)])
def test_a_file_gives_back_what_was_written(tmp_path, sizes):
    prints = some_prints(sizes)
    assert_all_same(from_file(PackedTemplates.pack(prints), tmp_path / "prints", COLUMNS), prints)


@pytest.mark.parametrize(
    ("name", "at", "value"),
    [
        *(("minutiae_start", 0, 1), ("minutiae_start", 1, 10**9), ("minutiae_start", 2, 20)),
        *(("minutiae_start", 1, -1), ("minutiae_start", 1, 2**63 - 1), ("minutiae_start", 3, 24)),
        *(("cell_start", 1, 10**9), ("cell_start", 1, -(2**63)), ("cell_start", 3, 0)),
        *(("xy", 3, np.nan), ("direction", 0, np.inf), ("direction", 4, np.nan)),
        *(("count", 0, 13), ("count", 24, 255), ("neighbour", 4, 12), ("neighbour", 299, 4)),
        *(("orientation_bins", 7, 32), ("orientation_bins", 299, 255)),
        *(("shape", 0, 100), ("shape", 0, -9), ("shape", 2, -1), ("shape", 3, 2**31 - 1)),
        *(("index", 0, -1), ("index", 3, 2), ("index", 24, -(2**31)), ("index", 13, 0)),
        *(("step", 1, np.nan), ("step", 1, 0.0), ("step", 2, -16.0), ("step", 0, np.inf)),
        *(("to_500dpi", 0, np.nan), ("to_500dpi", 1, 0.0), ("to_500dpi", 2, -1.0)),
        *(("xy", 0, 1e30), ("direction", 1, 0.5), ("step", 0, 1e-300), ("to_500dpi", 0, 1e300)),
        *(("index", 24, 2**16), ("step", 0, 1e300), ("direction", 2, 1e30)),
        *(("has_flow", 0, 2), ("has_ridges", 2, 255), ("inside", 0, -1), ("inside", 1, 10**9)),
    ],
)
def test_numbers_that_would_lead_astray_are_refused(name, at, value):
    assert_damaged(PackedTemplates.pack(some_prints((12, 9, 4))), name, at, value)


@pytest.mark.parametrize("columns", [2**31 - 1, 2**24 + 1])
def test_rows_of_no_cells_are_bounded(columns):
    """None of them is in the file, but a kernel adds to their number."""
    many = PackedTemplates.pack([prepare(template_of(spread_points(np.random.default_rng(1), 0)))])
    nothing = {"cell": many.cell[:0], "ridges": many.ridges[:0], "inside": many.inside * 0}
    nothing |= {"cell_start": many.cell_start * 0, "shape": np.array([[0, 3, 0, 0]], np.int32)}
    assert len(PackedTemplates.of_arrays(many.arrays() | nothing)) == 1
    nothing["shape"] = np.array([[0, columns, 0, 0]], np.int32)
    with pytest.raises(MatcherError):
        PackedTemplates.of_arrays(many.arrays() | nothing)


def test_starts_whose_differences_overflow_are_refused():
    many = PackedTemplates.pack(some_prints((12, 9, 4)))
    for name in ("minutiae_start", "cell_start"):
        starts = getattr(many, name).copy()
        starts[1:3] = 2**63 - 1, -(2**63) + starts[-1] + 1
        with pytest.raises(MatcherError):
            PackedTemplates.of_arrays(many.arrays() | {name: starts})


def test_ridges_are_compared_from_a_file_as_from_memory(tmp_path):
    """A mapped file cannot be written, which the kernels must not mind."""
    prints = some_prints((5, 5, 5, 6, 6, 6))
    loaded = from_file(PackedTemplates.pack(prints), tmp_path / "prints", COLUMNS)
    cells = []
    for k, print_ in enumerate(prints):
        identity = identity_alignment(print_.points)
        found = ridge_correlation(loaded[k], loaded[k], identity)
        assert found == ridge_correlation(print_, print_, identity)
        assert ridge_correlation(loaded[k], print_, identity) == found
        cells.append(found[1])
    assert cells == [0, 0, 64] * 2

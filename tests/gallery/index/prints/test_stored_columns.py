"""Columns of bits, cells and positions are as numpy computes them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.gallery.store._template_column_kernel import (
    read_cells,
    read_columns,
    write_columns,
)


def to_bits(values, width):
    """Return numbers from 0 on, each in `width` bits, as bytes."""
    places = np.arange(width - 1, -1, -1)
    return np.packbits(((values[:, None] >> places) & 1).astype(np.uint8))


some_widths = st.lists(st.integers(0, 32), min_size=2, max_size=2)


@given(st.lists(st.tuples(st.integers(0, 40), some_widths), max_size=4), st.integers(0, 2**32 - 1))
def test_columns_are_read_as_they_were_written(several, seed):
    rng = np.random.default_rng(seed)
    whole, written, at = bytearray(b"+"), [np.empty((2, 0), np.int64)], []
    for count, widths in several:
        columns = np.array([rng.integers(0, 2**width, count) for width in widths], np.int64)
        expected = [to_bits(column, width) for column, width in zip(columns, widths, strict=True)]
        data = np.zeros(sum(map(len, expected)), np.uint8)
        write_columns(columns, np.array(widths, np.int64), data)
        np.testing.assert_array_equal(data, np.concatenate(expected))
        at.append(len(whole))
        whole += data.tobytes() + b"+"
        written.append(columns)
    start = np.cumsum([0, *(count for count, _ in several)], dtype=np.int64)
    read = np.full((2, int(start[-1])), -1, np.int64)
    of_each = np.array([widths for _, widths in several], np.int64).reshape(-1, 2)
    read_columns(np.frombuffer(whole, np.uint8), np.array(at, np.int64), of_each, start, read)
    np.testing.assert_array_equal(read, np.concatenate(written, axis=1))


masks = st.tuples(st.integers(0, 7), st.integers(1, 11), st.floats(0, 1), st.integers(0, 1))


@given(st.lists(masks, max_size=4), st.integers(0, 2**32 - 1))
def test_cells_are_read_as_numpy_reads_them(several, seed):
    rng = np.random.default_rng(seed)
    whole, at, end, inside, tight = bytearray(b"+"), [], [], [], []
    shapes = np.array([(rows, columns) for rows, columns, *_ in several], np.int64).reshape(-1, 2)
    given_masks, given_steps = [], []
    for rows, columns, share, each in several:
        mask = rng.random((rows, columns)) < share
        steps = rng.integers(0, 16, np.count_nonzero(mask))
        at.append(len(whole))
        whole += np.packbits(mask).tobytes() + to_bits(steps, 4).tobytes()
        whole += b"-" * each * len(steps)
        end.append(len(whole))
        inside.append(len(steps))
        ends = [mask.any(axis=axis)[[0, -1]].all() for axis in (0, 1)] if rows else [False]
        tight.append(int(all(ends)))
        given_masks += mask.ravel().tolist()
        given_steps += steps.tolist()
    start = np.cumsum([0, *shapes.prod(axis=1)], dtype=np.int64)
    each = np.array([each for *_, each in several], np.int64)
    first, last = np.array(at, np.int64), np.array(end, np.int64)
    layout = start, shapes[:, 1].copy(), each
    cells, orientation = np.full((2, int(start[-1])), 77, np.uint8)
    after, is_tight = np.empty(len(several), np.int64), np.empty(len(several), np.uint8)
    data, into = np.frombuffer(whole, np.uint8), (cells, orientation, after, is_tight)
    count = read_cells(data, first, last, *layout, *into)
    assert count == sum(inside)
    assert cells.tolist() == given_masks
    assert orientation[:count].tolist() == given_steps
    assert after.tolist() == (last - each * np.array(inside, np.int64)).tolist()
    assert is_tight.tolist() == tight
    if any(inside):  # of another length: nothing is read
        assert read_cells(data, first, last - 1, *layout, *into) == 0
        assert (after == -1).all()

"""Ridge images of eight samples a cell: samples are exact, the rest is a wave along the ridges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.gallery.index.prints import ridge_samples as module
from fpmatch.gallery.index.prints.ridge_samples import (
    ORIENTATIONS,
    _looked_up,
    _table,
    restore_all,
    restore_ridges,
    sample_ridges,
)
from fpmatch.matching.constants.comparison import FEW_SAMPLES
from fpmatch.templates.minutiae import RidgeField

OUTSIDE = 16  # a half that is not known


def any_field(seed, rows, columns, share):
    rng = np.random.default_rng(seed)
    mask = rng.random((rows, columns)) < share
    n = int(np.count_nonzero(mask))
    orientation = rng.integers(0, ORIENTATIONS, n, np.uint8)
    return mask, orientation, rng.integers(0, 256, n, np.uint8)


def restored_twin(samples, orientation, mask, start, shape):
    """Return the ridge images of many prints, all cells of one at once."""
    ridges, filled, table = np.zeros(len(mask), np.uint64), 0, _table()
    for p in range(len(start) - 1):
        of, (rows, columns) = slice(start[p], start[p + 1]), shape[p, :2].tolist()
        row, column = np.nonzero(mask[of].reshape(rows, columns))
        inside = slice(filled, filled + len(row))
        filled = inside.stop
        own, both = orientation[inside], np.full((2, rows + 2, columns + 2), OUTSIDE)
        kept = samples[inside]
        both[:, row + 1, column + 1] = kept & 15, kept >> 4
        total = np.zeros((len(row), 8), np.uint64)
        for k, (half, down, right, _) in enumerate(_looked_up()):
            total += table[own, k, both[half, row + down, column + right]]
        highest = (total >> np.uint64(7)) & np.uint64(0x0101010101010101)
        bits = (highest * np.uint64(0x0102040810204080)) >> np.uint64(56)
        bits <<= np.arange(0, 64, 8, dtype=np.uint64)
        image = ridges[of].reshape(rows, columns)
        image[row, column] = np.bitwise_or.reduce(bits, axis=1)
    return ridges


fields = st.tuples(
    st.integers(0, 2**32 - 1),
    st.integers(0, 9),
    st.integers(0, 9),
    st.sampled_from([0.0, 0.5, 1.0]),
)


@given(fields)
def test_samples_are_kept(field):
    mask, orientation, samples = any_field(*field)
    ridges = restore_ridges(samples, orientation, mask)
    assert ridges.shape == mask.shape
    assert not ridges[~mask].any()
    assert sample_ridges(ridges[mask]).tolist() == samples.tolist()


def test_samples_are_the_bits_that_a_comparison_looks_at():
    for k, (row, column) in enumerate(FEW_SAMPLES):
        assert sample_ridges(np.array([1 << (8 * row + column)], np.uint64)) == [1 << k]
    others = (1 << 64) - 1 - sum(1 << (8 * row + column) for row, column in FEW_SAMPLES)
    assert sample_ridges(np.array([others], np.uint64)) == [0]


@given(st.lists(fields, max_size=3))
@settings(max_examples=20)
def test_the_kernel_is_the_weighted_sum_of_the_samples_around(several):
    parts = [any_field(*field) for field in several]
    mask, orientation, samples = (
        np.concatenate(
            [np.empty(0, np.uint8), *(part[k].ravel() for part in parts)], dtype=np.uint8
        )
        for k in range(3)
    )
    shape = np.array([part[0].shape for part in parts], np.int32).reshape(-1, 2)
    start = np.cumsum([0, *(part[0].size for part in parts)], dtype=np.int64)
    found = restore_all(samples, orientation, mask, start, shape)
    assert found.tolist() == restored_twin(samples, orientation, mask, start, shape).tolist()
    each = [restore_ridges(part[2], part[1], part[0]).ravel() for part in parts]
    assert found.tolist() == [word for one in each for word in one.tolist()]


def test_compiled_and_interpreted_agree(interpreted, monkeypatch):
    mask, orientation, samples = any_field(5, 9, 7, 0.6)
    found = restore_ridges(samples, orientation, mask)
    monkeypatch.setattr(module, "restore", interpreted("_ridge_sample_kernel").restore)
    assert restore_ridges(samples, orientation, mask).tolist() == found.tolist()


def test_the_table_says_as_much_for_a_ridge_as_against_it():
    """No sum of bytes carries; where nothing is known, the sum is that of a set bit."""
    table = _table().view(np.uint8).reshape(ORIENTATIONS, len(_looked_up()), 17, 64).astype(int)
    assert (table.max(axis=2).sum(axis=1) <= 255).all()
    assert (table[:, :, 16].sum(axis=1) == 128).all()
    assert (table[:, :, :16] + table[:, :, 15::-1] == 2 * table[:, :, 16:]).all()


@pytest.mark.parametrize("step", range(ORIENTATIONS))
@pytest.mark.parametrize("period", [4.4, 5.0])
def test_parallel_ridges_come_back(step, period):
    angle = step * np.pi / ORIENTATIONS
    y, x = np.mgrid[:48, :48]
    ridge = np.cos(2 * np.pi / period * (x * np.sin(angle) + y * np.cos(angle)) + 0.3) > 0
    cells = ridge.reshape(6, 8, 6, 8).swapaxes(1, 2).reshape(6, 6, 64)
    ridges = np.packbits(cells, axis=2, bitorder="little").view("<u8")[..., 0]
    mask = np.ones((6, 6), bool)
    orientation = np.full(36, step, np.uint8)
    found = restore_ridges(sample_ridges(ridges.ravel()), orientation, mask)
    kept = RidgeField(16, np.zeros((6, 6)), mask, found).bits[8:-8, 8:-8]
    assert (kept == ridge[8:-8, 8:-8]).mean() > 0.8

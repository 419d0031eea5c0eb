"""Scores of bit descriptors are normalized by the sizes of prints."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.gallery.index.size_normalization import SIZE_OFFSET, size_normalized


def scores_of_sizes(sizes, rng):
    """Scores whose mean and deviation, divided by the smaller size, grow with the size."""
    slope = np.log(sizes + SIZE_OFFSET)
    share = 0.2 * slope + 0.1 * slope * rng.standard_normal(len(sizes))
    return np.rint(share * (np.minimum(sizes, 30) + SIZE_OFFSET)).astype(np.int32)


def test_scores_of_many_prints_are_normalized_by_their_sizes():
    rng = np.random.default_rng(11)
    sizes = rng.integers(6, 90, 20_000)
    scores = scores_of_sizes(sizes, rng)
    found = size_normalized(scores, sizes, 30)
    for some in (sizes < 15, (sizes > 30) & (sizes < 45), sizes > 75):
        assert abs(found[some].mean()) < 0.06
        assert found[some].std() == pytest.approx(1, rel=0.08)
    assert abs(np.corrcoef(found, sizes)[0, 1]) < 0.02


@given(st.integers(0, 2**32 - 1), st.integers(1, 900), st.integers(0, 300))
@settings(max_examples=20)
def test_normalization_does_not_depend_on_the_order_of_the_prints(seed, count, probe_size):
    rng = np.random.default_rng(seed)
    sizes, scores = rng.integers(0, 400, count), rng.integers(0, 288, count)
    order = rng.permutation(count)
    whole = size_normalized(scores, sizes, probe_size)
    assert (
        whole[order].tolist() == size_normalized(scores[order], sizes[order], probe_size).tolist()
    )
    assert np.isfinite(whole).all()

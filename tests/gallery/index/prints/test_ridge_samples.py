"""Ridge images of eight samples a cell: samples are exact, the rest is a wave along the ridges."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.gallery.index.prints.ridge_samples import (
    ORIENTATIONS,
    restore_ridges,
    sample_ridges,
)


def any_field(seed, rows, columns, share):
    rng = np.random.default_rng(seed)
    mask = rng.random((rows, columns)) < share
    n = int(np.count_nonzero(mask))
    orientation = rng.integers(0, ORIENTATIONS, n, np.uint8)
    return mask, orientation, rng.integers(0, 256, n, np.uint8)


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

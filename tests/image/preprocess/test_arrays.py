import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from fpmatch.image.preprocess.arrays import (
    BLOCK_PX,
    StageRecorder,
    block_mean_product,
    blocks_to_pixels,
    percentiles,
)

GREYS = st.floats(0, 255, width=32)


def test_stages_are_kept_by_name_in_their_order_as_they_were():
    recorder, other = StageRecorder(), StageRecorder()
    array = np.zeros((4, 5), np.float32)
    for stage, recorded in (("second", array), ("first", np.zeros(2)), ("first", np.ones(3))):
        recorder.record(stage, recorded)
    array += 1
    assert list(recorder.stages) == ["second", "first"]
    assert not recorder.stages["second"].any()
    assert recorder.stages["second"].dtype == np.float32
    assert recorder.stages["first"].tolist() == [1, 1, 1]
    assert other.stages == {}


@given(
    npst.arrays(np.float32, npst.array_shapes(min_dims=1, max_dims=2, max_side=40), elements=GREYS),
    st.lists(st.floats(0, 100), min_size=1, max_size=3),
)
def test_they_are_those_of_numpy(values, percents):
    expected = np.percentile(values.astype(np.float64), [50, *percents], axis=-1)
    np.testing.assert_allclose(percentiles(values, 50, *percents), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("shape", [(1, 1), (7, 9), (8, 8), (17, 40), (48, 1)])
def test_products_are_averaged_over_blocks_that_repeat_the_edge(rng, shape):
    a, b = rng.normal(0, 1, (2, *shape)).astype(np.float32)
    a.setflags(write=False)
    means = block_mean_product(a, b)
    assert means.dtype == np.float32
    repeated = np.pad(a * b, [(0, -side % BLOCK_PX) for side in shape], mode="edge")
    rows, columns = (side // BLOCK_PX for side in repeated.shape)
    expected = repeated.reshape(rows, BLOCK_PX, columns, BLOCK_PX).mean(axis=(1, 3))
    np.testing.assert_allclose(means, expected, rtol=0, atol=1e-5)
    np.testing.assert_array_equal(block_mean_product(np.asfortranarray(a), b), means)
    at_pixels = blocks_to_pixels(means, shape)
    assert at_pixels.shape == shape
    assert means.min() - 1e-5 <= at_pixels.min() <= at_pixels.max() <= means.max() + 1e-5

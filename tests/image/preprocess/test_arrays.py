import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from fpmatch.image.preprocess.arrays import percentiles

GREYS = st.floats(0, 255, width=32)


@given(
    npst.arrays(np.float32, npst.array_shapes(min_dims=1, max_dims=2, max_side=40), elements=GREYS),
    st.lists(st.floats(0, 100), min_size=1, max_size=3),
)
def test_they_are_those_of_numpy(values, percents):
    expected = np.percentile(values.astype(np.float64), [50, *percents], axis=-1)
    np.testing.assert_allclose(percentiles(values, 50, *percents), expected, rtol=1e-9, atol=1e-9)

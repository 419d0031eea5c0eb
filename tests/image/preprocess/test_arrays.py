"""Each stage by name, in order, as it was; percentiles of arrays."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from fpmatch.image.preprocess.arrays import Box, StageRecorder, UncropRecorder, percentiles

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


def test_images_of_a_box_are_padded_and_all_else_is_passed_on():
    recorder = StageRecorder()
    uncrop = UncropRecorder(recorder, Box(16, 20, 32, 38), (30, 40))
    for stage, shape in (("image", (4, 6)), ("columns", (9, 5)), ("whole", (30, 40))):
        uncrop.record(stage, np.ones(shape, np.float32))
    shapes = {stage: array.shape for stage, array in recorder.stages.items()}
    assert shapes == {"image": (30, 40), "columns": (9, 5), "whole": (30, 40)}
    assert recorder.stages["image"].sum() == recorder.stages["image"][16:20, 32:38].sum() == 24


def test_a_recorder_receives_the_stages_that_it_wants():
    class Some(StageRecorder):
        wanted = frozenset({"mask"})

    box = Box(0, 16, 0, 16)
    for recorder, expected in ((StageRecorder(), ["mask", "period"]), (Some(), ["mask"])):
        stages = UncropRecorder(recorder, box, (32, 32))
        for stage in ("mask", "period"):
            assert stages.wants(stage) is (stage in expected)
            stages.record(stage, np.zeros((16, 16)))
        assert list(recorder.stages) == expected
    nobody = UncropRecorder(None, box, (32, 32))
    nobody.record("mask", np.zeros((16, 16)))
    assert not nobody.wants("mask")


@given(
    npst.arrays(np.float32, npst.array_shapes(min_dims=1, max_dims=2, max_side=40), elements=GREYS),
    st.lists(st.floats(0, 100), min_size=1, max_size=3),
)
def test_they_are_those_of_numpy(values, percents):
    expected = np.percentile(values.astype(np.float64), [50, *percents], axis=-1)
    np.testing.assert_allclose(percentiles(values, 50, *percents), expected, rtol=1e-9, atol=1e-9)

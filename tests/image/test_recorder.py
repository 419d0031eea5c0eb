"""Each stage by name, in order, as it was."""

from __future__ import annotations

import numpy as np

from fpmatch.image.preprocess.foreground import Box
from fpmatch.image.recorder import StageRecorder, UncropRecorder


def test_stages_are_kept_in_their_order():
    recorder = StageRecorder()
    for k, stage in enumerate(["second", "first", "third"]):
        recorder.record(stage, np.full((2, 3), k))
    assert list(recorder.stages) == ["second", "first", "third"]
    assert [int(array[0, 0]) for array in recorder.stages.values()] == [0, 1, 2]


def test_what_was_recorded_does_not_change_with_its_source():
    recorder = StageRecorder()
    array = np.zeros((4, 5), np.float32)
    recorder.record("stage", array)
    array += 1
    assert not recorder.stages["stage"].any()
    assert recorder.stages["stage"].dtype == np.float32


def test_a_stage_of_the_same_name_takes_the_place_of_the_first():
    recorder = StageRecorder()
    recorder.record("stage", np.zeros(2))
    recorder.record("other", np.zeros(2))
    recorder.record("stage", np.ones(3))
    assert list(recorder.stages) == ["stage", "other"]
    assert recorder.stages["stage"].tolist() == [1, 1, 1]


def test_two_recorders_share_nothing():
    one, other = StageRecorder(), StageRecorder()
    one.record("stage", np.zeros(2))
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

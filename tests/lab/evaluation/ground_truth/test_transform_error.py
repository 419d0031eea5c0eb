import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from truth_files import truth_of

from fpmatch.lab.evaluation.ground_truth.transform_error import (
    TransformError,
    common_minutiae,
    measure_transform,
    summarise_transforms,
)
from fpmatch.lab.evaluation.ground_truth.truth import ImpressionTruth
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae

RNG = np.random.default_rng(4)
FINGER = RNG.uniform(50, 350, (20, 2))
TO_PROBE = Similarity(1.02, 0.3, 40.0, -20.0)
TO_REFERENCE = Similarity(0.97, -0.2, 5.0, 60.0)
TRUE = TO_REFERENCE.after(TO_PROBE.inverse())


def pressed(transform, stretch=0.0):
    """Return an impression of `FINGER`, with minutiae pulled about by `stretch` pixels."""
    xy = transform.apply(FINGER) + stretch * np.sin(FINGER[:, ::-1])
    return truth_of(Minutiae(*xy.T, np.zeros(len(xy))), transform=transform)


PROBE, REFERENCE = pressed(TO_PROBE), pressed(TO_REFERENCE)


def test_the_true_transform_has_no_error():
    error = measure_transform(TRUE, PROBE, REFERENCE)
    assert error.rotation_deg == pytest.approx(0, abs=1e-9)
    assert error.shift_px == pytest.approx(0, abs=1e-9)
    assert error.scale == pytest.approx(1)
    assert error.residual_px == pytest.approx(0, abs=1e-3)  # float32 positions
    assert error.match


@given(st.floats(-180, 180), st.floats(0.8, 1.25), st.floats(-20, 20), st.floats(-20, 20))
def test_what_is_off_is_measured(degrees, scale, dx, dy):
    """The found transform turns and grows about the middle of the overlap, and shifts it."""
    middle = REFERENCE.visible_xy.mean(axis=0)
    turn = Similarity(scale, math.radians(degrees))
    tx, ty = middle - turn.apply([middle])[0] + np.array([dx, dy])
    found = Similarity(scale, turn.rotation, tx, ty).after(TRUE)
    error = measure_transform(found, PROBE, REFERENCE, match=False)
    assert error.rotation_deg == pytest.approx(abs(degrees), abs=1e-6)
    assert error.shift_px == pytest.approx(math.hypot(dx, dy), abs=1e-3)
    assert error.scale == pytest.approx(scale)
    assert not error.match


def test_common_are_the_same_minutiae_seen_in_both():
    minutiae = Minutiae(x=[0, 1, 2, 3], y=[0, 0, 0, 0], angle=[0, 0, 0, 0])
    one = truth_of(minutiae, [True, True, False, True])
    shuffled = ImpressionTruth(
        transform=Similarity(),
        minutiae=Minutiae(x=[30, 20, 10], y=[0, 0, 0], angle=[0, 0, 0]),
        master=np.array([3, 2, 1]),
        visible=np.array([True, True, False]),
        hidden_xy=np.empty((0, 2)),
    )
    p, q = common_minutiae(one, shuffled)
    assert (p[:, 0].tolist(), q[:, 0].tolist()) == ([3], [30])


NAN = float("nan")
GOOD = TransformError(True, 1.0, 2.0, 1.02, 2.0, 1.0)
TURNED = TransformError(True, 3.0, 4.0, 0.98, 6.0, 1.0)
SHIFTED = TransformError(False, 2.0, 5.0, 1.0, 4.0, 1.0)
NONE = TransformError(False, NAN, NAN, NAN, NAN, 3.0)


def test_shares_are_of_all_judged_and_errors_of_those_with_a_transform():
    summary = summarise_transforms([GOOD, TURNED, SHIFTED, NONE])
    assert summary.judged == 4
    assert (summary.match, summary.in_place) == (0.5, 0.25)
    assert (summary.rotation_in_limits, summary.shift_in_limits) == (0.5, 0.5)
    assert (summary.rotation_deg, summary.shift_px, summary.residual_px) == (2, 4, 4)
    assert summary.scale_percent == pytest.approx(2)
    assert summary.rotation_deg_p95 == pytest.approx(2.9)
    assert summary.least_residual_px == 1

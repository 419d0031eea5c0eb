"""`fpmatch.evaluation.ground_truth.transform_summary`: many errors in a few figures."""

from __future__ import annotations

import math
from dataclasses import astuple

import pytest

from fpmatch.evaluation.ground_truth.transform_error import TransformError, summarise_transforms

NAN = float("nan")
GOOD = TransformError(True, 1.0, 2.0, 1.02, 2.0, 1.0)
TURNED = TransformError(True, 3.0, 4.0, 0.98, 6.0, 1.0)
SHIFTED = TransformError(False, 2.0, 5.0, 1.0, 4.0, 1.0)
NONE = TransformError(False, NAN, NAN, NAN, NAN, 3.0)


def test_shares_are_of_all_judged_and_errors_of_those_with_a_transform() -> None:
    summary = summarise_transforms([GOOD, TURNED, SHIFTED, NONE])
    assert summary.judged == 4
    assert (summary.match, summary.in_place) == (0.5, 0.25)
    assert (summary.rotation_in_limits, summary.shift_in_limits) == (0.5, 0.5)
    assert (summary.rotation_deg, summary.shift_px, summary.residual_px) == (2, 4, 4)
    assert summary.scale_percent == pytest.approx(2)
    assert summary.rotation_deg_p95 == pytest.approx(2.9)
    assert summary.least_residual_px == 1


def test_no_pairs_and_no_transforms_say_nothing() -> None:
    judged, *figures = astuple(summarise_transforms([]))
    assert judged == 0
    assert all(map(math.isnan, figures))
    alone = summarise_transforms([NONE])
    assert (alone.match, alone.in_place) == (0, 0)
    assert math.isnan(alone.rotation_deg)

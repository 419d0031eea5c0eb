from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from pointset_strategies import any_finite_points

from fpmatch.errors import PointSetError
from fpmatch.pointset.frames import UnitFrame
from fpmatch.pointset.points import as_points


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        ([1.0, 2.0], r"shape \(N, 2\)"),
        (np.zeros((3, 3)), r"shape \(N, 2\)"),
        ([[0.0, np.nan]], "finite"),
        ([[0.0, np.inf]], "finite"),
        ([["a", "b"]], "numbers"),
        ([[1, 2], [3]], "numbers"),
    ],
)
def test_malformed_points_are_refused_by_name(bad: object, reason: str) -> None:
    with pytest.raises(PointSetError, match=f"^probe: .*{reason}"):
        as_points(bad, "probe")  # type: ignore[arg-type]


def test_no_points_have_two_columns() -> None:
    assert as_points([]).shape == (0, 2)


def test_points_are_copied() -> None:
    mine = np.ones((2, 2))
    as_points(mine)[0, 0] = 5
    assert mine[0, 0] == 1


@given(any_finite_points)
def test_unit_frame_holds_the_points_in_the_unit_square(points: np.ndarray) -> None:
    unit = UnitFrame.of(points).apply(points)
    assert unit.shape == points.shape
    assert ((unit >= 0) & (unit < 1)).all()
    distinct = len(np.unique(points, axis=0))
    if distinct > 1:
        assert unit.max() >= 0.5


def test_unit_frame_is_exact_for_whole_pixels() -> None:
    points = np.array([[3.0, 700.0], [388.0, 12.0], [41.0, 1.0]])
    frame = UnitFrame.of(points)
    unit = frame.apply(points)
    assert np.array_equal(np.ldexp(unit, frame.exponent) + points.min(axis=0), points)

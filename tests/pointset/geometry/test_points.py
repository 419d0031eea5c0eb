from __future__ import annotations

import numpy as np
import pytest

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.points import as_points


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


def test_points_are_copied_into_two_columns() -> None:
    mine = np.ones((2, 2))
    as_points(mine)[0, 0] = 5
    assert mine[0, 0] == 1
    assert as_points([]).shape == (0, 2)

"""The paper's tables as typed in here, held against what the paper says of them in words."""

from __future__ import annotations

import numpy as np
import pytest

from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS


def test_the_rows_are_three_settings_of_growing_size() -> None:
    settings = {(row.rho, row.eta, row.lambda_) for row in PAPER_ROWS}
    assert settings == {(0.95, 0.175, 0.428), (0.6, 0.25, 0.61), (0.9, 0.4, 0.84)}
    sizes = [row.m for row in PAPER_ROWS]
    assert sizes == [50, 100, 200, 400, 800, 50, 100, 200, 400, 50, 100, 200, 400]


def test_the_means_are_those_the_paper_gives() -> None:
    assert np.mean([row.van_wamelen_s[0] for row in PAPER_ROWS]) == pytest.approx(1.4113, abs=1e-4)
    assert np.mean([row.unit_circle_s[0] for row in PAPER_ROWS]) == pytest.approx(0.0022, abs=5e-5)


@pytest.mark.parametrize("table", ["van_wamelen_s", "unit_circle_s"])
def test_times_grow_with_either_set(table: str) -> None:
    times = np.array([getattr(row, table) for row in PAPER_ROWS])
    assert times.shape == (len(PAPER_ROWS), len(TARGET_FACTORS))
    assert (np.diff(times, axis=1) > 0).all()
    for rho in (0.95, 0.6, 0.9):
        assert (np.diff(times[[row.rho == rho for row in PAPER_ROWS]], axis=0) > 0).all()

"""Decisions on comparisons that were made before are those of `verify`."""

from __future__ import annotations

import numpy as np
import pytest

from fpmatch.evaluation.decision import decide, rho_of
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers import matcher_names
from fpmatch.matching.verify import verify
from fpmatch.minutiae import Minutiae, Template


@pytest.mark.parametrize("matcher", matcher_names())
def test_similarities_are_decided_as_verify_decides(matcher: str) -> None:
    rng = np.random.default_rng(3)
    templates = [
        Template(Minutiae(*rng.uniform(20, 280, (2, n)), np.zeros(n)), width=300, height=300)
        for n in (20, 25, 30)
    ]
    for probe in templates:
        for reference in templates:
            found = verify(probe, reference, matcher=matcher)
            similarity = found.matched_share if found.rho is not None else _similarity(found.score)
            assert bool(decide(matcher, similarity)) == found.match


def _similarity(score: float) -> float:
    """Return a similarity of that score, by the default matcher."""
    tried = np.linspace(-50, 50, 100_001)
    return float(tried[np.abs(load_calibration("unit-circle").scores(tried) - score).argmin()])


def test_the_paper_decides_by_more_than_rho() -> None:
    assert decide("paper", [[0.0, 0.6], [0.600001, 1.0]]).tolist() == [[False] * 2, [True] * 2]
    assert rho_of("paper") == 0.6


def test_a_matcher_that_is_not_known_finds_no_match() -> None:
    assert rho_of("mine") is None
    assert not decide("mine", [0.0, 1e9]).any()

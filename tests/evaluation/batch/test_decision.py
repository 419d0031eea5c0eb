"""Decisions on comparisons that were made before are those of `verify`."""

import itertools

import numpy as np
import pytest

from fpmatch.evaluation.batch.decision import matches, rho_of
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers import matcher_names
from fpmatch.matching.verify import verify
from fpmatch.minutiae import Minutiae, Template


@pytest.mark.parametrize("matcher", matcher_names())
def test_similarities_are_decided_as_verify_decides(matcher):
    rng = np.random.default_rng(3)
    templates = [
        Template(Minutiae(*rng.uniform(20, 280, (2, n)), np.zeros(n)), width=300, height=300)
        for n in (20, 25, 30)
    ]
    for probe, reference in itertools.product(templates, repeat=2):
        found = verify(probe, reference, matcher=matcher)
        similarity = found.matched_share if found.rho is not None else _similarity(found.score)
        assert bool(matches(matcher, similarity)) == found.match


def _similarity(score):
    """Return a similarity of that score, by the default matcher."""
    tried = np.linspace(-50, 50, 100_001)
    return float(tried[np.abs(load_calibration("unit-circle").scores(tried) - score).argmin()])


def test_the_paper_decides_by_more_than_rho_and_an_unknown_matcher_finds_no_match():
    assert matches("paper", [[0.0, 0.6], [0.600001, 1.0]]).tolist() == [[False] * 2, [True] * 2]
    assert (rho_of("paper"), rho_of("mine")) == (0.6, None)
    assert not matches("mine", [0.0, 1e9]).any()

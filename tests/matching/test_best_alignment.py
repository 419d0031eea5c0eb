"""Search of the best alignment: which hypotheses are tried and refined, and which one is taken."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import COMPILED, doubled_prints, seeds
from matching_weights import ALWAYS, NEVER, scored_by, some_weights

from fpmatch.matching import reference
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.pipeline.evidence import evidence_scorer
from fpmatch.matching.pipeline.match import match


def matched_by_reference(a, b, weights):
    with scored_by(weights):
        return reference.match(a, b)


@given(
    seeds,
    st.sampled_from([ALWAYS, NEVER, -20.0, -8.0, -2.0, 3.0]),
    st.sampled_from([-math.inf, -5.0, 0.0, 5.0, math.inf]),
    st.sampled_from([-1.0, 0.01, 0.05, 0.2, math.inf]),
)
def test_match_agrees_with_the_reference(seed, refine, confident, relaxation):
    """Which hypotheses are tried, which are refined, and which of them is the result."""
    a, b = doubled_prints(seed)
    weights = some_weights(refine, confident=confident, relaxation=relaxation, apart=2.0)
    found = match(a, b, evidence_scorer(max(len(a), len(b)), weights))
    expected = matched_by_reference(a, b, weights)
    assert (found is None) == (expected is None)
    if found is not None:
        assert found[0].partner.tolist() == expected[0].partner.tolist()
        assert complex(*found[0].transform[:2]) == pytest.approx(expected[0].move[0], rel=1e-9)
        assert found[1].total == pytest.approx(expected[1].total, rel=1e-9)


def test_the_cases_to_align_are_of_every_kind():
    """The first hypothesis is not always the best, nor the first whose sum is confident."""
    same = []
    for seed in range(30 if COMPILED else 9):
        a, b = doubled_prints(seed)
        scorers = (
            evidence_scorer(max(len(a), len(b)), some_weights(relaxation=weak, confident=sure))
            for weak, sure in ((-1.0, math.inf), (math.inf, math.inf), (-1.0, 0.0))
        )
        every, *others = (match(a, b, scorer)[0].partner.tolist() for scorer in scorers)
        same.append([one == every for one in others])
    assert (np.sum(same, axis=0) > 0).all()
    assert (np.sum(same, axis=0) < len(same)).all()


@pytest.mark.parametrize("hypotheses", [1, 16, 17, 32])
def test_any_number_of_hypotheses_can_be_asked_for(hypotheses):
    a, b = doubled_prints(2)
    room, parameters = max(len(a), len(b)), UnitCircleMatcher(hypotheses=hypotheses).parameters
    _, evidence = match(a, b, evidence_scorer(room, some_weights()), parameters)
    assert evidence.pairs

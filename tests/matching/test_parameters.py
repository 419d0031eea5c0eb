import math
import pickle
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import COMPILED

from fpmatch.base.parameters import parameters_of
from fpmatch.errors import MatcherError
from fpmatch.image.extract import extract
from fpmatch.matching.matchers.unit_circle import MATCHER, ReferenceMatcher, UnitCircleMatcher
from fpmatch.matching.registry import get_matcher

SAMPLES = Path(__file__).parents[2] / "sample_data"
KNOWN = parameters_of(MATCHER.parameters)


@cache
def sample(name):
    return extract(SAMPLES / f"{name}.tif")


@st.composite
def some_parameters(draw, most=4):
    """Return values in the ranges of some parameters, the extremes among them."""
    given_ = {}
    for name in draw(st.lists(st.sampled_from(sorted(KNOWN)), max_size=most, unique=True)):
        one = KNOWN[name]
        number = st.integers if isinstance(one.value, int) else st.floats
        inside = number(one.least, one.most)
        given_[name] = draw(st.one_of(st.sampled_from([one.least, one.most]), inside))
    return given_


@given(some_parameters(), st.sampled_from(["101_3", "102_1"]))
@settings(max_examples=40 if COMPILED else 5)
def test_with_any_parameters_kernels_and_reference_agree(given_, other):
    compiled, plain = UnitCircleMatcher(**given_), ReferenceMatcher(**given_)
    sides = [(m.prepare(sample("101_1")), m.prepare(sample(other))) for m in (compiled, plain)]
    ours, theirs = compiled.compare(*sides[0]), plain.compare(*sides[1])
    assert ours.pairs.tolist() == theirs.pairs.tolist()
    assert ours.similarity == pytest.approx(theirs.similarity, rel=1e-6, abs=1e-9)
    back = compiled.compare(*sides[0][::-1])
    assert back.similarity == ours.similarity
    explained = compiled.explain(*sides[0], ours)
    assert explained.similarity == ours.similarity


@given(some_parameters(most=9))
def test_a_name_makes_the_same_matcher(given_):
    made = UnitCircleMatcher(**given_)
    again = get_matcher(made.name)
    sent = pickle.loads(pickle.dumps(made))
    for other in (again, sent):
        assert other.name == made.name
        assert parameters_of(other.parameters) == parameters_of(made.parameters)
    usual = all(value == KNOWN[name].value for name, value in given_.items())
    assert (made.name == "unit-circle") == usual
    assert get_matcher(made.name) is again


WRONG = {
    "unit-circle:round=3": "no parameter 'round'. Did you mean 'rounds'?",
    "unit-circle:rounds=three": "rounds is a whole number, not 'three'",
    "unit-circle:rounds=2.5": "rounds is a whole number, not '2.5'",
    "unit-circle:reach_px=nan": "reach_px is a number, not 'nan'",
    "unit-circle:reach_px=inf": "reach_px lies from 0.1 to 100, not inf",
    "unit-circle:rounds=-1": "rounds lies from 1 to 20, not -1",
    "unit-circle:rounds": "parameters are NAME=VALUE, not 'rounds'",
    "unit-circle:rounds=1,rounds=2": "rounds is given twice",
    "unit-circle:rounds=1,": "parameters are NAME=VALUE, not ''",
    "paper:rho=1.5": "rho lies from 0 to 1, not 1.5",
    "paper:area_tolerance=0": "area_tolerance lies from",
    "paper:rounds=3": "matcher paper has no parameter 'rounds'",
    "unit-circl:rounds=3": "unknown matcher 'unit-circl'",
    "unit_circle": "known: paper, reference, unit-circle. Did you mean 'unit-circle'?",
    "": "unknown matcher ''",
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_name_or_parameter_is_named(name):
    with pytest.raises(MatcherError) as error:
        get_matcher(name)
    assert WRONG[name] in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("value", [True, None, "x", 2.5, math.nan, [1]])
def test_an_argument_of_another_kind_is_refused(value):
    with pytest.raises(MatcherError, match="rounds is a whole number"):
        UnitCircleMatcher(rounds=value)

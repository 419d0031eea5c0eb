import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import (
    FILES,
    Calibration,
    fmr_to_score,
    load_calibration,
    score_to_fmr,
)
from fpmatch.matching.registry import OWN_MATCHERS

HEAVY_TAIL = Calibration(
    knots=((0.0, 0.0), (0.5, 7.25), (1.0, 12.0), (2.5, 29.125)),
    tail_scale=0.7,
    tail_shape=0.2,
    provenance={"sets": ["FVC", "Größe"], "impostors": 20_000, "matcher": "unit-circle"},
)
GOOD = json.loads(HEAVY_TAIL.as_json())


def test_score_is_linear_between_knots_and_clipped_below():
    assert HEAVY_TAIL.scores([-5.0, 0.0, 0.25, 0.75, 2.5]).tolist() == [0, 0, 3.625, 9.625, 29.125]
    x = np.array([[-1.0, 0.0, 0.3], [2.0, 20.0, 1e9]])
    assert HEAVY_TAIL.scores(x).tolist() == [[HEAVY_TAIL.score(v) for v in row] for row in x]


@given(st.floats(2.5, 1e9), st.floats(0, 0.9))
def test_tail_is_the_generalised_pareto_distribution(similarity, shape):
    calibration = Calibration(HEAVY_TAIL.knots, 0.7, shape)
    excess = (similarity - 2.5) / 0.7
    survival = math.exp(-excess) if shape < 1e-6 else (1 + shape * excess) ** (-1 / shape)
    expected = 29.125 - 10 * math.log10(survival) if survival > 1e-20 else 100.0
    assert calibration.score(similarity) == pytest.approx(min(expected, 100.0), rel=1e-4)
    assert Calibration(((0.0, 0.0),), tail_scale=5e-324).score(1.0) == 100.0  # no overflow


def test_json_round_trip():
    again = Calibration.from_json(HEAVY_TAIL.as_json())
    assert again == HEAVY_TAIL
    assert again.as_json() == HEAVY_TAIL.as_json()


BROKEN = [b"{", b"[]", b"null", b"[" * 100_000, b"\xff\xfe"]
BROKEN += [json.dumps({k: v for k, v in GOOD.items() if k != key}).encode() for key in GOOD]
for key, values in {
    "knots": (
        *([], [[0, 0], [1]], [[0, 0, 0]], [[0, 0], [0, 1]], [[0, 1], [1, 1]]),
        *([[0, -1], [1, 1]], [[0, math.nan]]),
    ),
    "tail_scale": (0, "wide", math.inf, 10**400),
    "tail_shape": (-0.1,),
    "provenance": (None, 3),
}.items():
    BROKEN += [json.dumps({**GOOD, key: value}).encode() for value in values]


@pytest.mark.parametrize("content", BROKEN)
def test_a_broken_file_is_named(tmp_path, content):
    file = tmp_path / "some.json"
    file.write_bytes(content)
    with pytest.raises(MatcherError, match=r"some\.json: .*calibration") as caught:
        load_calibration("unit-circle", file)
    assert "\n" not in str(caught.value)


def test_a_file_takes_the_place_of_the_package(tmp_path):
    file = tmp_path / "ours.json"
    with pytest.raises(MatcherError, match=r"ours\.json: cannot be read: no such file"):
        load_calibration("unit-circle", file)
    file.write_text(HEAVY_TAIL.as_json(), encoding="utf-8")
    assert load_calibration("unit-circle", file) == HEAVY_TAIL
    named = r"ours\.json: calibrates matcher 'unit-circle', not 'p'"
    with pytest.raises(MatcherError, match=named):
        load_calibration("p", file)
    file.write_text(json.dumps({**GOOD, "provenance": {}}))  # for no known matcher
    assert load_calibration("any", file).knots == HEAVY_TAIL.knots


def test_each_matcher_of_the_package_has_a_calibration_for_its_usual_parameters():
    assert set(FILES) == set(OWN_MATCHERS)
    for name in FILES:
        calibration = load_calibration(name)
        assert calibration.provenance["impostors"] >= 1000
        assert calibration.provenance["sets"]
        assert calibration.score(calibration.knots[-1][0] + 1e6 * calibration.tail_scale) == 100
    assert load_calibration("paper:rho=0.9") is not load_calibration("unit-circle")
    assert load_calibration("paper:rho=0.9") == load_calibration("paper")
    with pytest.raises(MatcherError, match="'nobody'"):
        load_calibration("nobody")
    for name in ("unit-circle:rounds=5", "paper:rho=0.9,area_tolerance=0.2", "reference:rounds=5"):
        with pytest.raises(MatcherError, match="is for its usual parameters"):
            load_calibration(name)


@pytest.mark.parametrize(("fmr", "score"), [(1.0, 0.0), (0.001, 30.0), (1e-4, 40.0), (1e-10, 100)])
def test_fmr_and_score_are_two_forms_of_one_number(fmr, score):
    assert fmr_to_score(fmr) == pytest.approx(score)
    assert math.copysign(1.0, fmr_to_score(fmr)) == 1.0
    assert score_to_fmr(score) == pytest.approx(fmr)


@pytest.mark.parametrize(
    ("convert", "values", "reason"),
    [
        (fmr_to_score, (0.0, -0.1, 1.1, 1e-11, math.nan, math.inf), "1e-10 to 1"),
        (score_to_fmr, (-0.1, 100.1, math.nan), "0 to 100"),
    ],
)
def test_impossible_rates_and_scores(convert, values, reason):
    for value in values:
        with pytest.raises(MatcherError, match=reason):
            convert(value)

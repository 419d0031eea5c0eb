import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import MatcherError
from fpmatch.matching import calibration as module
from fpmatch.matching.calibration import (
    Calibration,
    Provenance,
    calibrated_matchers,
    fmr_to_score,
    load_calibration,
    score_to_fmr,
)

HEAVY_TAIL = Calibration(
    knots=((0.0, 0.0), (0.5, 7.25), (1.0, 12.0), (2.5, 29.125)),
    tail_scale=0.7,
    tail_shape=0.2,
    provenance=Provenance(("FVC", "Größe"), 20_000, "1.2.3", "a command", "unit-circle", 60),
)


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


def test_thinnest_tail_overflows_into_the_highest_score():
    assert Calibration(((0.0, 0.0),), tail_scale=5e-324).score(1.0) == 100.0


def test_json_round_trip():
    text = HEAVY_TAIL.as_json()
    again = Calibration.from_json(text)
    assert again == HEAVY_TAIL
    assert again.as_json() == text


def broken_files():
    good = json.loads(HEAVY_TAIL.as_json())
    yield from ("{", "[]", "null", "[" * 100_000)
    for key in good:
        yield json.dumps({k: v for k, v in good.items() if k != key})
    for key, values in {
        "knots": (
            *([], [[0, 0], [1]], [[0, 0, 0]], [[0, 0], [0, 1]], [[0, 1], [1, 1]]),
            *([[0, -1], [1, 1]], [[0, math.nan]]),
        ),
        "tail_scale": (0, "wide", math.inf, 10**400),
        "tail_shape": (-0.1,),
        "provenance": (None,),
    }.items():
        yield from (json.dumps({**good, key: value}) for value in values)


@pytest.mark.parametrize("text", [pytest.param(text, id=text[:60]) for text in broken_files()])
def test_broken_file_is_named(text):
    with pytest.raises(MatcherError, match=r"^some\.json: ") as caught:
        Calibration.from_json(text, "some.json")
    assert "\n" not in str(caught.value)


def test_package_files_load_and_say_where_they_come_from():
    for name in calibrated_matchers():
        calibration = load_calibration(name)
        assert calibration.provenance.impostors >= 1000
        assert calibration.provenance.sets
        assert calibration.score(calibration.knots[-1][0] + 1e6 * calibration.tail_scale) == 100


def test_a_file_takes_the_place_of_the_package(tmp_path):
    file = tmp_path / "ours.json"
    file.write_text(HEAVY_TAIL.as_json(), encoding="utf-8")
    assert load_calibration("unit-circle", file) == HEAVY_TAIL
    named = r"ours\.json: calibrates matcher 'unit-circle', not 'p'"
    with pytest.raises(MatcherError, match=named):
        load_calibration("p", file)
    entries = json.loads(HEAVY_TAIL.as_json())
    del entries["provenance"]["matcher"], entries["provenance"]["fingers"]
    file.write_text(json.dumps(entries))  # as written before matchers were named
    assert load_calibration("any", file).knots == HEAVY_TAIL.knots


@pytest.mark.parametrize(
    ("content", "reason"),
    [(None, "cannot be read: no such file"), (b"\xff\xfe", "not a calibration file")],
)
def test_a_file_that_is_none_is_named(tmp_path, content, reason):
    file = tmp_path / "ours.json"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(MatcherError, match=rf"ours\.json: {reason}"):
        load_calibration("unit-circle", file)


def test_matcher_without_calibration(tmp_path, monkeypatch):
    with pytest.raises(MatcherError, match="'nobody'"):
        load_calibration("nobody")
    (tmp_path / "odd.json").write_text("{}")
    monkeypatch.setattr(module, "CALIBRATION_FOLDER", tmp_path)
    assert calibrated_matchers() == ["odd"]
    with pytest.raises(MatcherError, match=r"odd\.json: "):
        load_calibration("odd")


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

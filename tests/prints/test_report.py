"""`fpmatch.prints.report`: numbers that are none never reach the JSON, nor odd words the eye."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.matching.result import Compared, Comparison
from fpmatch.matching.verification import Verification
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.prints.report import as_dict, as_text, odds


def verification(template, transform, rms_px, reason="", compared=None):
    pairs = np.array([[0, 1], [2, 3]], np.int32)
    similarity, agreement, overlap = 5.0, 0.816, 0.74
    found = Comparison(
        similarity, transform, pairs, rms_px, agreement, overlap, reason, compared=compared
    )
    match, score = bool(np.bool_(transform is not None)), np.float64(52.3)
    return Verification(match, score, 5.9e-6, 40.0, "unit-circle", found, template, template)


def test_text_of_a_match(template):
    found = verification(template, Similarity(1.004, -0.2, 12.4, -5.1), 2.13)
    assert as_text(found).splitlines() == [
        "MATCH",
        "  Score       52.3 on a scale to 100; a match needs 40.0",
        "  FMR         1 in 170,000 pairs of different fingers scores as high",
        "  Minutiae    2 pairs among 30 of the probe and 30 of the reference",
        "  Agreement   82% of the minutiae where the prints overlap are paired",
        "  Overlap     74% of the smaller print",
        "  Transform   rotation -11.5° (counter-clockwise), scale 1.004, "
        "shift +12.4 px right, -5.1 px down",
        "  Residual    2.1 px rms",
    ]


def test_text_and_json_contain_how_much_was_compared(template):
    move = Similarity(1.0, 0.0, 0.0, 0.0)
    compared = Compared(44, 93.4, 0.562, 86.2)
    lines = as_text(verification(template, move, 2.0, compared=compared)).splitlines()
    assert lines[5:7] == [
        "  Overlap     74% of the smaller print, 93 mm²",
        "  Ridges      agreement 0.56 on 86 mm²",
    ]
    compared = Compared(44, 93.4, None, 0.0)
    found = verification(template, move, 2.0, compared=compared)
    assert as_text(found).splitlines()[6] == "  Ridges      not compared"
    assert as_dict(found, "a", "b")["compared"] == {
        **{"minutiae": 44, "area_mm2": 93.4, "ridge_agreement": None},
        "ridge_area_mm2": 0.0,
    }
    assert as_dict(verification(template, move, 2.0), "a", "b")["compared"] is None


def test_text_without_a_transform(template):
    lines = as_text(verification(template, None, float("nan"), "no common region")).splitlines()
    assert lines[0] == "NO MATCH"
    assert lines[-1] == "  Reason      no common region"
    assert not any("px" in line for line in lines)


def test_the_dict_is_strict_json(template):
    for rms_px in (float("nan"), float("inf"), 0.0):
        found = verification(template, None, rms_px, "no common region")
        document = as_dict(found, Path("a.png"), Path("b.png"))
        assert json.loads(json.dumps(document, allow_nan=False)) == document
        assert document["transform"] is None
        assert document["rms_px"] is None
        assert document["pairs"] == 2


@pytest.mark.parametrize(
    ("fmr", "expected"),
    [
        (1.0, "nearly all"), (0.94, "1 in 1.1"),
        (0.5, "1 in 2"), (0.01, "1 in 100"), (0.0123, "1 in 81"),
        (1e-3, "1 in 1,000"), (1 / 999_999, "1 in 1 million"), (2.5e-7, "1 in 4 million"),
        (1e-8, "1 in 100 million"), (1e-10, "1 in 10 billion"),
        (0.0, "unknown"), (-1.0, "unknown"), (math.nan, "unknown"),
    ],
)  # fmt: skip
def test_odds_in_words(fmr, expected):
    assert odds(fmr) == expected


@given(st.floats(1e-10, 0.95))
def test_odds_are_right_to_two_digits(fmr):
    count, *unit = odds(fmr).removeprefix("1 in ").split()
    size = {"million": 1e6, "billion": 1e9}[unit[0]] if unit else 1
    assert float(count.replace(",", "")) * size == pytest.approx(1 / fmr, rel=0.051)

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.drawing.caption import MARGIN, evidence, header, movement, odds, verdict
from fpmatch.drawing.fonts import text_width
from fpmatch.drawing.scene import Text
from fpmatch.pointset.similarity import Similarity


def lines(items, role=None):
    return [i.text for i in items if isinstance(i, Text) and role in {None, i.role}]


@pytest.mark.parametrize(
    ("fmr", "expected"),
    [
        (1.0, "1 in 1"),
        (0.5, "1 in 2"),
        (0.01, "1 in 100"),
        (0.0123, "1 in 81"),
        (1e-3, "1 in 1,000"),
        (1 / 999_999, "1 in 1 million"),
        (2.5e-7, "1 in 4 million"),
        (1e-8, "1 in 100 million"),
        (1e-10, "1 in 10 billion"),
        (0.0, "unknown"),
        (-1.0, "unknown"),
        (math.nan, "unknown"),
    ],
)
def test_odds_are_told_in_words(fmr, expected):
    assert odds(fmr) == expected


@given(st.floats(1e-10, 1.0))
def test_odds_are_right_to_two_digits(fmr):
    number, *unit = odds(fmr).removeprefix("1 in ").split()
    size = {"million": 1e6, "billion": 1e9}[unit[0]] if unit else 1
    assert float(number.replace(",", "")) * size == pytest.approx(1 / fmr, rel=0.051)


def test_a_turn_is_told_as_it_is_seen(compared):
    def rotation(degrees):
        transform = Similarity(rotation=math.radians(degrees))
        return dict(movement(compared(transform=transform)))["Rotation of probe"]

    assert rotation(12.34) == "12.3° clockwise"  # y points down
    assert rotation(-90) == "90.0° counter-clockwise"
    assert rotation(1e-9) == "0.0°"


def test_without_a_transform_nothing_is_said_of_movement(compared):
    nothing = compared(transform=None)
    assert movement(nothing) == []
    assert "Overlap" not in dict(evidence(nothing))


def test_unknown_figures_are_left_out(compared):
    unsure = compared(rms_px=math.nan, agreement=math.nan)
    assert dict(movement(unsure))["Residual"] == "-"
    assert dict(evidence(unsure))["Agreement"] == "-"


@pytest.mark.parametrize("score", [-5.0, 0.0, 100.0, 250.0, math.nan])
@pytest.mark.parametrize("width", [500.0, 800.0, 2000.0])
def test_the_band_holds_its_words(compared, score, width):
    items, height = header(compared(score=score, reason="no common region " * 9), width)
    for item in items:
        if isinstance(item, Text):
            extent = text_width(item.text, item.size)
            left = item.x - {"start": 0, "middle": extent / 2, "end": extent}[item.anchor]
            assert left >= MARGIN - 1
            assert left + extent <= width - MARGIN + 1
            assert item.size <= item.y + 5 <= height + 5


def test_the_reason_is_given_for_a_no(compared):
    items, with_reason = header(compared(match=False, reason="too few minutiae"), 900)
    assert lines(items, "reason") == ["Why: too few minutiae"]
    assert lines(items, "verdict") == ["NO MATCH"]
    items, without = header(compared(), 900)
    assert lines(items, "reason") == []
    assert lines(items, "verdict") == ["MATCH"] == [verdict(compared())]
    assert without < with_reason


def test_an_endless_reason_is_cut(compared):
    items, _ = header(compared(match=False, reason="word " * 5000), 900)
    assert len(lines(items, "reason")) == 4
    assert lines(items, "reason")[-1].endswith("…")

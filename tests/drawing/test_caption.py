import math

import pytest

from fpmatch.drawing.overlay.caption import MARGIN, evidence, header, transform_facts
from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.items import Text
from fpmatch.matching.result import Compared
from fpmatch.pointset.geometry.similarity import Similarity


def lines(items, role=None):
    return [i.text for i in items if isinstance(i, Text) and role in {None, i.role}]


def test_the_sense_of_a_rotation_is_that_on_screen(compared):
    def rotation(degrees):
        transform = Similarity(rotation=math.radians(degrees))
        return dict(transform_facts(compared(transform=transform)))["Rotation of probe"]

    assert rotation(12.34) == "12.3° (clockwise)"  # y points down
    assert rotation(-90) == "-90.0° (counter-clockwise)"
    assert rotation(1e-9) == "0.0°"


def test_ridge_agreement_is_shown_where_it_is_known(compared):
    shown = dict(evidence(compared(compared=Compared(44, 93.4, 0.562, 86.2))))
    assert shown["Overlap"] == "90 %, 93 mm²"
    assert shown["Ridge agreement"] == "0.56"
    without = dict(evidence(compared(compared=Compared(44, 93.4, None, 0.0))))
    assert "Ridge agreement" not in without
    assert dict(evidence(compared()))["Overlap"] == "90 %"


def test_identical_images_are_named_in_the_verdict_and_have_no_rate(compared):
    for identical, words in (("pixels", "images"), ("template", "templates")):
        found = compared(identical=identical)
        assert "False match rate" not in dict(evidence(found))
        items, _ = header(found, 900)
        assert lines(items, "verdict") == [f"MATCH, identical {words}"]
    assert "False match rate" in dict(evidence(compared()))


def test_unknown_values_are_dashes_or_left_out(compared):
    nothing = compared(transform=None)
    assert transform_facts(nothing) == []
    assert "Overlap" not in dict(evidence(nothing))
    unsure = compared(rms_px=math.nan, agreement=math.nan)
    assert dict(transform_facts(unsure))["Residual"] == "-"
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


def test_the_reason_of_a_non_match_is_shown_and_cut_where_it_is_long(compared):
    items, with_reason = header(compared(match=False, reason="too few minutiae"), 900)
    assert lines(items, "reason") == ["Why: too few minutiae"]
    assert lines(items, "verdict") == ["NO MATCH"]
    items, without = header(compared(), 900)
    assert lines(items, "reason") == []
    assert lines(items, "verdict") == ["MATCH"]
    assert without < with_reason
    items, _ = header(compared(match=False, reason="word " * 5000), 900)
    assert len(lines(items, "reason")) == 4
    assert lines(items, "reason")[-1].endswith("…")

import math

import pytest

from fpmatch.drawing.overlay.page import MARGIN, facts, header
from fpmatch.drawing.scene.items import Text, text_width
from fpmatch.matching.result import Compared


def facts_of(verification):
    return {label: value for row in facts(verification) for label, value in row}


def lines(verification, role):
    caption, _ = header(verification, (900, 500))
    return [i.text for i in caption.items if isinstance(i, Text) and i.role == role]


def test_what_is_unknown_is_a_dash_or_left_out(compared):
    shown = facts_of(compared(compared=Compared(44, 93.4, 0.562, 86.2)))
    assert (shown["Overlap"], shown["Ridge agreement"]) == ("90 %, 93 mm²", "0.56")
    unsure = facts_of(compared(rms_px=math.nan, overlap=0.0))
    assert (unsure["Residual"], unsure["Agreement"], unsure["Overlap"]) == ("-", "-", "-")
    assert "Ridge agreement" not in unsure
    assert not {"Overlap", "Scale"} & facts_of(compared(transform=None)).keys()


def test_identical_images_are_named_in_the_verdict_and_have_no_rate(compared):
    assert "False match rate" in facts_of(compared())
    for identical, words in (("pixels", "images"), ("template", "templates")):
        found = compared(identical=identical)
        assert "False match rate" not in facts_of(found)
        assert lines(found, "verdict") == [f"MATCH, identical {words}"]


@pytest.mark.parametrize("score", [-5.0, 0.0, 100.0, 250.0, math.nan])
@pytest.mark.parametrize("width", [500.0, 2000.0])
def test_the_band_holds_its_words_and_lies_above_the_panel(compared, score, width):
    verification = compared(score=score, reason="no common region " * 9)
    caption, place = header(verification, (width, 300))
    band = caption.clip
    assert (place.width, place.height) == (width, 300)
    assert place.y > band.bottom
    assert place.right <= band.width
    for item in caption.items:
        if isinstance(item, Text):
            extent = text_width(item.text, item.size)
            left = item.x - {"start": 0, "middle": extent / 2, "end": extent}[item.anchor]
            assert MARGIN - 1 <= left <= band.width - MARGIN + 1 - extent
            assert item.size <= item.y + 5 <= band.bottom + 5


def test_the_reason_of_a_non_match_is_shown_and_cut_where_it_is_long(compared):
    few = compared(match=False, reason="too few minutiae")
    assert (lines(few, "verdict"), lines(few, "reason")) == (
        ["NO MATCH"],
        ["Why: too few minutiae"],
    )
    assert lines(compared(), "reason") == []
    long = lines(compared(match=False, reason="word " * 5000), "reason")
    assert len(long) == 4
    assert long[-1].endswith("…")

from __future__ import annotations

import pytest

from fpmatch.drawing.fonts import printable, text_width, wrapped


def test_wider_text_is_wider():
    assert text_width("iii", 20) < text_width("WWW", 20) < text_width("WWW", 30)
    assert text_width("", 20) == 0


@pytest.mark.parametrize("width", [40.0, 120.0, 400.0])
def test_wrapping_keeps_words_and_width(width):
    text = "no transform brings more than 3 minutiae together"
    lines = wrapped(text, 14.0, width)
    assert " ".join(lines) == text
    assert all(text_width(line, 14.0) <= width or " " not in line for line in lines)
    assert wrapped("  \n ", 14.0, width) == []


def test_signs_that_the_font_lacks_are_spelt():
    assert printable("2 × 3 ≥ −1") == "2 x 3 >= -1"

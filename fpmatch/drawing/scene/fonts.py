"""The one font of the scenes, the scalable one that comes inside Pillow, and lines of text."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Final, cast

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

_SPELLINGS: Final = str.maketrans(
    {"−": "-", "–": "-", "—": "-", "×": "x", "≥": ">=", "≤": "<=", "→": "->", "≈": "~"}
    | {"θ": "theta"}
)
_SQUARED_SIZE, _SQUARED_RISE = 0.6, 0.36  # of the size of the text


@lru_cache(maxsize=32)
def _font(size: float) -> FreeTypeFont:
    from PIL import ImageFont  # noqa: PLC0415

    return cast("FreeTypeFont", ImageFont.load_default(size))


def parts(text: str, size: float) -> list[tuple[str, FreeTypeFont, float]]:
    """Return `text` on one line in parts, as (letters, font, rise in pixels).

    Characters that the font lacks are spelled out where possible; ² is a raised 2.
    """
    line = " ".join(text.translate(_SPELLINGS).split())
    squared = ("2", _font(_SQUARED_SIZE * size), _SQUARED_RISE * size)
    pieces = filter(None, re.split("(²)", line))
    return [squared if letters == "²" else (letters, _font(size), 0.0) for letters in pieces]


def text_width(text: str, size: float) -> float:
    """Return the width of `text` in pixels at `size`."""
    return sum(float(font.getlength(letters)) for letters, font, _ in parts(text, size))


def wrapped(text: str, size: float, width: float) -> list[str]:
    """Break `text` between words into lines no wider than `width` where its words allow it."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines

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
def font(size: float) -> FreeTypeFont:
    """Return the font at `size` pixels."""
    from PIL import ImageFont  # noqa: PLC0415

    return cast("FreeTypeFont", ImageFont.load_default(size))


def printable(text: str) -> str:
    """Return `text` on one line, with characters that the font lacks spelled out where possible."""
    return " ".join(text.translate(_SPELLINGS).split())


def text_width(text: str, size: float) -> float:
    """Return the width of `text` in pixels at `size`."""
    return sum(float(font(own).getlength(letters)) for letters, own, _ in parts(text, size))


def parts(text: str, size: float) -> list[tuple[str, float, float]]:
    """Return `text` in parts, as (letters, size, rise): ², which the font lacks, is a raised 2."""
    split = filter(None, re.split("(²)", printable(text)))
    squared = ("2", _SQUARED_SIZE * size, _SQUARED_RISE * size)
    return [squared if letters == "²" else (letters, size, 0.0) for letters in split]


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

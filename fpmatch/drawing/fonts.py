"""The one font of the scenes, the scalable one that comes inside Pillow, and lines of text."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, cast

if TYPE_CHECKING:
    from collections.abc import Callable

    from PIL.ImageFont import FreeTypeFont

_SPELLINGS: Final = str.maketrans(
    {"−": "-", "–": "-", "—": "-", "×": "x", "≥": ">=", "≤": "<=", "→": "->", "≈": "~"}
    | {"θ": "theta"}
)


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
    return float(font(size).getlength(printable(text)))


def wrapped(
    text: str, size: float, width: float, measure: Callable[[str, float], float] = text_width
) -> list[str]:
    """Break `text` between words into lines no wider than `width` where its words allow it.

    `measure` returns the width of a text at a size.
    """
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and measure(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines

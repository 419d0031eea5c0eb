"""Colours of the drawings, distinguishable with any kind of colour vision.

Blue and orange differ in lightness as well as in hue, and lie on the axis that the common colour
deficiencies leave intact; printed over each other as inks they make a near black. They are darkened
relatives of the palette in Okabe and Ito, "Color Universal Design" (2008).
"""

from __future__ import annotations

from typing import Final

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

PAPER: Final[Colour] = (255, 255, 255)
PANEL_EDGE: Final[Colour] = (198, 202, 208)
BAND: Final[Colour] = (243, 245, 247)

TEXT: Final[Colour] = (24, 28, 33)
TEXT_MUTED: Final[Colour] = (99, 106, 115)

PROBE_INK: Final[Colour] = (66, 142, 244)
REFERENCE_INK: Final[Colour] = (255, 150, 38)
NEUTRAL_INK: Final[Colour] = (120, 122, 126)

PROBE_MARK: Final[Colour] = (0, 62, 150)
REFERENCE_MARK: Final[Colour] = (190, 62, 0)
PAIR_LINK: Final[Colour] = (12, 12, 12)
EXAMINER_MARK: Final[Colour] = (122, 31, 162)

# From low to high, along blue and yellow and from dark to light: pale relatives of cividis (Nuñez,
# Anderton, Renslow, PLOS ONE 13(7), 2018), so that ridges stay legible on them.
AGREEMENT: Final[tuple[Colour, ...]] = (
    *((84, 118, 178), (136, 158, 192), (196, 198, 198)),
    *((228, 218, 158), (255, 234, 96)),
)

MATCH: Final[Colour] = (0, 114, 86)
NO_MATCH: Final[Colour] = (168, 34, 28)
INCONCLUSIVE: Final[Colour] = (122, 92, 0)
DECISION: Final = {"match": MATCH, "no match": NO_MATCH, "inconclusive": INCONCLUSIVE}


def hexadecimal(colour: Colour) -> str:
    """Write a colour as CSS and SVG do."""
    return "#" + bytes(colour).hex()


def agreement(value: float) -> Colour:
    """Return the colour of an agreement of ridges: the lowest for 0 and less, the highest for 1."""
    place = min(max(value, 0.0), 1.0) * (len(AGREEMENT) - 1)
    k = min(int(place), len(AGREEMENT) - 2)
    low, high, share = AGREEMENT[k], AGREEMENT[k + 1], place - k
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue

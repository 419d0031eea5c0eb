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
BOTH_INKS: Final[Colour] = (66, 84, 36)  # the two printed over each other
NEUTRAL_INK: Final[Colour] = (120, 122, 126)

PROBE_MARK: Final[Colour] = (0, 62, 150)
REFERENCE_MARK: Final[Colour] = (190, 62, 0)
PROBE_FAINT: Final[Colour] = (46, 97, 169)  # of what is unpaired, and of edges
REFERENCE_FAINT: Final[Colour] = (202, 97, 46)
PAIR_LINK: Final[Colour] = (12, 12, 12)
EXAMINER_MARK: Final[Colour] = (122, 31, 162)

MATCH: Final[Colour] = (0, 114, 86)
NO_MATCH: Final[Colour] = (168, 34, 28)
INCONCLUSIVE: Final[Colour] = (122, 92, 0)
DECISION: Final = {"match": MATCH, "no match": NO_MATCH, "inconclusive": INCONCLUSIVE}


def hexadecimal(colour: Colour) -> str:
    """Write a colour as CSS and SVG do."""
    return "#" + bytes(colour).hex()

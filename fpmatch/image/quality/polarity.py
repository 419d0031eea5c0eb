"""Polarity: whether a print shows its ridges white on black.

Ridges and valleys differ as lines (see `fpmatch.image.quality.line_cues`). For a single image the
background is weak evidence too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.preprocess.arrays import percentiles
from fpmatch.image.quality.ridge_scale import likely_dpi

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Grey

Polarity = Literal["auto", "dark", "white"]
"""Grey level of an image's ridges; "auto": to be found."""

INVERTED: Final = "its ridges are white on black: turned into dark ones"
POLARITIES: Final[tuple[Polarity, ...]] = ("auto", "dark", "white")

MIN_EVIDENCE: Final = 4.0  # log-odds from which a polarity is certain
BACKGROUND_ODDS: Final = 3.0  # log-odds that a background like the bright or dark lines adds
CLEAR_LEVEL: Final = 0.2  # background level, -1 to 1, from which a background is clearly bright

# The search for the background: every second pixel, in blocks, by the standard deviation of each.
_STEP_PX: Final = 2
_BLOCK_PX: Final = 8
_STRONG_PERCENTILE: Final = 90.0  # the deviation that is the print's contrast
_PRINT_CONTRAST, _QUIET_CONTRAST = 0.5, 0.15  # shares of it: least of a print, most of background
_MIN_CONTRAST: Final = 1.0  # grey levels
_MIN_PRINT, _MIN_BACKGROUND = 0.05, 0.02  # shares of the blocks
_LINE_PERCENTILES: Final = (10.0, 90.0)  # of the print's grey values: dark and bright lines
_MAX_OTHER: Final = 0.2  # share of the background of the other half of the grey levels


def is_inverted(grey: Grey, dpi: float | None = None) -> bool:
    """Return whether a single print (H, W) certainly shows white ridges.

    A clearly bright background, which most sensors with dark ridges have, settles the question
    without the cues of the lines.
    """
    background = background_level(grey)
    if background > CLEAR_LEVEL:
        return False
    from fpmatch.image.quality.line_cues import polarity_evidence  # noqa: PLC0415

    evidence = polarity_evidence(grey, dpi or likely_dpi(grey))
    return evidence + BACKGROUND_ODDS * background <= -MIN_EVIDENCE


def check_polarity(polarity: object) -> Polarity:
    """Return a polarity; raise ImageError if it is none of `POLARITIES`."""
    if polarity in POLARITIES:
        return polarity
    raise ImageError(f"no polarity {polarity!r}: there are {', '.join(POLARITIES)}")


def background_level(grey: Grey) -> float:
    """Return the brightness of a print's background, -1 of its dark lines to 1 of its bright lines.

    It is 0 where there is no background in the image (H, W), or it is of both kinds.
    """
    few = grey[::_STEP_PX, ::_STEP_PX]
    rows, columns = (side // _BLOCK_PX for side in few.shape)
    whole = few[: rows * _BLOCK_PX, : columns * _BLOCK_PX].astype(np.float32)
    tiles = whole.reshape(rows, _BLOCK_PX, columns, _BLOCK_PX).swapaxes(1, 2)
    blocks = tiles.reshape(-1, _BLOCK_PX**2)
    if not len(blocks):
        return 0.0
    deviation = blocks.std(axis=1)
    contrast = float(percentiles(deviation, _STRONG_PERCENTILE)[0])
    print_ = deviation > _PRINT_CONTRAST * contrast
    quiet = deviation < _QUIET_CONTRAST * contrast
    if contrast < _MIN_CONTRAST or print_.mean() < _MIN_PRINT or quiet.mean() < _MIN_BACKGROUND:
        return 0.0
    dark, bright = percentiles(blocks[print_].ravel(), *_LINE_PERCENTILES)
    middle = percentiles(blocks[quiet], 50)[0]
    levels = 2 * (middle - dark) / max(bright - dark, 1.0) - 1
    level = float(np.clip(percentiles(levels, 50)[0], -1, 1))
    other = float((np.sign(levels) == -np.sign(level)).mean())
    return level if other <= _MAX_OTHER else 0.0

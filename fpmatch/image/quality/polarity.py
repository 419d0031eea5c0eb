"""Polarity: whether a print shows its ridges white on black, by the grey level of its background.

A sensor shows skin without contact like the valleys. So a background as dark as the dark lines of
the print means that the valleys are dark, and the ridges white.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.preprocess.arrays import percentiles

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Grey

Polarity = Literal["auto", "dark", "white"]
"""Grey level of an image's ridges; "auto": to be found."""

INVERTED: Final = "its ridges are white on black: turned into dark ones"
POLARITIES: Final[tuple[Polarity, ...]] = ("auto", "dark", "white")
CLEAR_LEVEL: Final = 0.3  # background level, -1 to 1, from which a background is clearly bright

# The search for the background: every second pixel, in blocks, by the standard deviation of each.
_STEP_PX: Final = 2
_BLOCK_PX: Final = 8
_STRONG_PERCENTILE: Final = 90.0  # of the deviations that is the print's contrast
_PRINT_CONTRAST, _QUIET_CONTRAST = 0.5, 0.15  # shares of it: least of a print, most of background
_MIN_CONTRAST: Final = 1.0  # grey levels
_MIN_PRINT, _MIN_BACKGROUND = 0.05, 0.02  # shares of the blocks
_MIN_BORDER: Final = 0.08  # share of background in the blocks at the border: a blot has less
_LINE_PERCENTILES: Final = (10.0, 90.0)  # of the print's grey values: dark and bright lines
_MAX_OTHER: Final = 0.2  # share of the background of the other half of the grey levels


def check_polarity(polarity: object) -> Polarity:
    """Return a polarity; raise ImageError if it is none of `POLARITIES`."""
    if polarity in POLARITIES:
        return polarity
    raise ImageError(f"no polarity {polarity!r}: there are {', '.join(POLARITIES)}")


def background_level(grey: Grey) -> float:
    """Return the brightness of a print's background, -1 of its dark lines to 1 of its bright lines.

    It is 0 where there is no background at the border of the image (H, W), or it is of both kinds.
    """
    few = grey[::_STEP_PX, ::_STEP_PX]
    rows, columns = (side // _BLOCK_PX for side in few.shape)
    if not rows * columns:
        return 0.0
    whole = few[: rows * _BLOCK_PX, : columns * _BLOCK_PX].astype(np.float32)
    tiles = whole.reshape(rows, _BLOCK_PX, columns, _BLOCK_PX).swapaxes(1, 2)
    blocks = tiles.reshape(rows, columns, _BLOCK_PX**2)
    deviation = blocks.std(axis=2)
    contrast = float(percentiles(deviation.ravel(), _STRONG_PERCENTILE)[0])
    print_ = deviation > _PRINT_CONTRAST * contrast
    quiet = deviation < _QUIET_CONTRAST * contrast
    border = np.ones_like(quiet)
    border[1:-1, 1:-1] = False
    enough = print_.mean() >= _MIN_PRINT and quiet.mean() >= _MIN_BACKGROUND
    if contrast < _MIN_CONTRAST or not enough or quiet[border].mean() < _MIN_BORDER:
        return 0.0
    dark, bright = percentiles(blocks[print_].ravel(), *_LINE_PERCENTILES).tolist()
    levels = 2 * (percentiles(blocks[quiet], 50)[0] - dark) / max(bright - dark, 1.0) - 1
    level = float(np.clip(percentiles(levels, 50)[0], -1, 1))
    other = float((np.sign(levels) == -np.sign(level)).mean())
    return level if other <= _MAX_OTHER else 0.0

"""Polarity: whether a print shows its ridges white on black."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.percentiles import percentiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

INVERTED: Final = "its ridges are white on black: turned into dark ones"


@dataclass(frozen=True, slots=True)
class PolarityParameters:
    """Set how the background is told from the print; shares of 0 to 1.

    Parameters
    ----------
    block_px : int
        Side of the blocks that are looked at.
    max_blocks_px : int
        Pixels that are looked at, about; of a larger image every second, third, ...
    strong_percentile : float
        Percentile of the blocks' deviations that stands for the print's contrast.
    print_contrast, quiet_contrast : float
        Share of that contrast above which a block is print, and below which it is background.
    min_contrast : float
        Deviation in grey levels below which there is no print.
    min_print, min_background : float
        Share of the blocks that must be print, and background.
    white_percentiles : tuple of float
        Percentiles of the print's grey values that stand for its dark and its bright lines.
    dark_level, bright_level : float
        Places between these two below which a background is dark, and above which bright.
    max_bright : float
        Share of the background that may be bright where the ridges are white.
    """

    block_px: int = 16
    max_blocks_px: int = 4_000_000
    strong_percentile: float = 90.0
    print_contrast: float = 0.5
    quiet_contrast: float = 0.15
    min_contrast: float = 8.0
    min_print: float = 0.05
    min_background: float = 0.02
    white_percentiles: tuple[float, float] = (10.0, 90.0)
    dark_level: float = 0.4
    bright_level: float = 0.6
    max_bright: float = 0.2


def ridges_are_white(grey: NDArray[np.uint8], parameters: PolarityParameters | None = None) -> bool:
    """Tell whether a print shows white ridges, by the background that it lies on.

    Where no skin touches the sensor it sees what it sees in a valley. A background darker than
    most of the print therefore means that the dark lines are the valleys.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Image.
    parameters : PolarityParameters, optional
        Thresholds.

    Returns
    -------
    bool
        False also where there is no print, or no background to tell by.

    Examples
    --------
    >>> waves = 128 + 100 * np.cos(np.arange(96) * 0.7)
    >>> dark_ridges = np.full((160, 160), 250, np.uint8)
    >>> dark_ridges[32:128, 32:128] = waves
    >>> ridges_are_white(dark_ridges), ridges_are_white(255 - dark_ridges)
    (False, True)
    """
    p = parameters or PolarityParameters()
    step = max(1, int(np.ceil(np.sqrt(grey.size / p.max_blocks_px))))
    blocks = _blocks(grey[::step, ::step], p.block_px)
    if not len(blocks):
        return False
    deviation = blocks.std(axis=1)
    contrast = float(percentiles(deviation, p.strong_percentile)[0])
    print_ = deviation > p.print_contrast * contrast
    quiet = deviation < p.quiet_contrast * contrast
    if contrast < p.min_contrast or print_.mean() < p.min_print or quiet.mean() < p.min_background:
        return False
    dark, bright = percentiles(blocks[print_].ravel(), *p.white_percentiles)
    level = (percentiles(blocks[quiet], 50)[0] - dark) / max(bright - dark, 1.0)
    is_bright = float((level > p.bright_level).mean())
    return bool(percentiles(level, 50)[0] < p.dark_level and is_bright <= p.max_bright)


def _blocks(grey: NDArray[np.uint8], side: int) -> NDArray[np.float32]:
    """Return the whole blocks of an image, shape (N, side * side)."""
    rows, columns = grey.shape[0] // side, grey.shape[1] // side
    whole = grey[: rows * side, : columns * side].astype(np.float32)
    return whole.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(-1, side * side)

"""Many prints on one page, all at one scale, so that they can be compared by eye."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import accumulate, zip_longest
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.drawing.scene.fonts import wrapped
from fpmatch.drawing.scene.items import Item, Path, Pen, Text
from fpmatch.drawing.scene.palette import PANEL_EDGE, TEXT_MUTED
from fpmatch.drawing.scene.raster import paint_over
from fpmatch.errors import OutputError
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

DEFAULT_DPI: Final = 250.0  # of the sheet: half of what most sensors give
LARGEST_SIDE_PX: Final = 16384  # of a sheet
_GAP: Final = 14
_CAPTION_SIZE: Final = 12.0
_LEADING: Final = 15
_PAPER: Final = 255
_EDGE: Final = Pen(PANEL_EDGE, width=1.0)


@dataclass(frozen=True, slots=True, eq=False)
class PrintTile:
    """One print of a sheet.

    `pixels` (H, W): the picture. `dpi`: its resolution. `caption`: what to write below it. Raises a
    `ResolutionError` if `dpi` is outside 100 to 4000.
    """

    pixels: NDArray[np.uint8] = field(repr=False)
    dpi: float
    caption: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "dpi", check_dpi(self.dpi))


def print_sheet(
    rows: Sequence[Sequence[PrintTile]], *, dpi: float = DEFAULT_DPI
) -> NDArray[np.uint8]:
    """Draw prints row by row, at one scale, each above its caption; rows may differ in length."""
    check_dpi(dpi)
    if not any(rows):
        raise OutputError("a sheet of prints needs at least one print")
    sizes = [[_size_at(tile, dpi) for tile in row] for row in rows]
    widths = [max(w for w, _ in column) for column in zip_longest(*sizes, fillvalue=(0, 0))]
    captions = [
        [
            wrapped(tile.caption, _CAPTION_SIZE, width)
            for tile, width in zip(row, widths, strict=False)
        ]
        for row in rows
    ]
    heights = [
        max((height for _, height in row), default=0) + _LEADING * max(map(len, lines), default=0)
        for row, lines in zip(sizes, captions, strict=True)
    ]
    lefts = list(accumulate((width + _GAP for width in widths), initial=_GAP))
    tops = list(accumulate((height + _GAP for height in heights), initial=_GAP))
    if max(lefts[-1], tops[-1]) > LARGEST_SIDE_PX:
        raise OutputError(
            f"a sheet of {lefts[-1]} x {tops[-1]} pixels: each side may be "
            f"{LARGEST_SIDE_PX} at most; draw fewer prints, or at a lower resolution"
        )
    page = np.full((tops[-1], lefts[-1]), _PAPER, np.uint8)
    items: list[Item] = []
    for row, row_sizes, lines, y in zip(rows, sizes, captions, tops, strict=False):
        for tile, (width, height), caption, x in zip(row, row_sizes, lines, lefts, strict=False):
            page[y : y + height, x : x + width] = _scaled(tile.pixels, (width, height))
            items += _frame(x, y, width, height)
            items += _words(caption, x, y + height)
    painted = paint_over(np.repeat(page[:, :, None], 3, axis=2), tuple(items))
    return np.asarray(cv2.cvtColor(painted, cv2.COLOR_RGB2GRAY), np.uint8)


def _size_at(tile: PrintTile, dpi: float) -> tuple[int, int]:
    """Return the width and height of a print on a sheet of this resolution."""
    height, width = tile.pixels.shape
    return max(round(width * dpi / tile.dpi), 1), max(round(height * dpi / tile.dpi), 1)


def _scaled(pixels: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    shrinks = size[0] < pixels.shape[1]
    interpolation = cv2.INTER_AREA if shrinks else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(pixels, size, interpolation=interpolation), np.uint8)


def _frame(x: float, y: float, width: float, height: float) -> list[Item]:
    corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
    return [Path(corners, _EDGE, closed=True)]


def _words(lines: Sequence[str], x: float, y: float) -> list[Item]:
    return [
        Text(x, y + n * _LEADING, line, _CAPTION_SIZE, TEXT_MUTED)
        for n, line in enumerate(lines, start=1)
    ]

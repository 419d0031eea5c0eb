"""All stages of an extraction: each as a picture, and together on one contact sheet."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.folders import write_files
from fpmatch.drawing.scene.ink import shrunk
from fpmatch.drawing.scene.items import Box, Item, Path, Pen, Scene, Text
from fpmatch.drawing.scene.palette import PANEL_EDGE, TEXT, TEXT_MUTED
from fpmatch.drawing.scene.raster import paint, png_bytes
from fpmatch.drawing.stages.pictures import Picture, stage_picture, value_range
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    import os
    import pathlib
    from collections.abc import Mapping

    from numpy.typing import NDArray

_TILE_SIDE: Final = 480  # pixels of a tile's longer side, at most
_LEAST_TILE_SIDE: Final = 240  # leaves room for the title
_GAP: Final = 20
_TITLE_HEIGHT: Final = 30
_TITLE_SIZE, _DETAIL_SIZE = 18.0, 13.0
_SHEET_ASPECT: Final = 1.5  # width over height that the grid approximates
_EDGE: Final = Pen(PANEL_EDGE, width=1.0)


def write_stages(
    stages: Mapping[str, NDArray[Any]], folder: str | os.PathLike[str]
) -> list[pathlib.Path]:
    """Write each stage as ``01_input.png`` and so on, and ``contact_sheet.png``, the last returned.

    Nothing is written where an array cannot be drawn.
    """
    pictures = _pictures(stages)
    stems = (re.sub(r"[^\w-]+", "_", name) or "stage" for name in pictures)
    files = {
        f"{n:02d}_{stem}.png": png_bytes(picture)
        for n, (stem, picture) in enumerate(zip(stems, pictures.values(), strict=True), 1)
    }
    files["contact_sheet.png"] = png_bytes(_sheet(stages, pictures))
    return write_files(files, folder)


def _pictures(stages: Mapping[str, NDArray[Any]]) -> dict[str, Picture]:
    if not stages:
        raise OutputError("there is no stage to draw")
    beneath = stages.get("input")
    usable = beneath is not None and beneath.dtype == np.uint8 and beneath.ndim == 2
    backdrop = beneath if usable else None
    return {name: stage_picture(name, array, backdrop) for name, array in stages.items()}


def _sheet(stages: Mapping[str, NDArray[Any]], pictures: dict[str, Picture]) -> Picture:
    height, width = next(iter(pictures.values())).shape[:2]
    factor = min(_TILE_SIDE / max(height, width), 1.0)
    tile_width = max(round(width * factor), _LEAST_TILE_SIDE)
    tile_height = max(round(height * factor), 1)
    cell_width, cell_height = tile_width + _GAP, tile_height + _GAP + _TITLE_HEIGHT
    columns = _columns(len(pictures), cell_width, cell_height)
    items: list[Item] = []
    tiles: list[tuple[int, int, Picture]] = []
    for n, (name, picture) in enumerate(pictures.items()):
        height, width = picture.shape[:2]
        tile = shrunk(picture, min(tile_width / width, tile_height / height))
        x = _GAP + (n % columns) * cell_width
        y = _GAP + _TITLE_HEIGHT + (n // columns) * cell_height
        tiles.append((x, y, tile))
        values = value_range(name, np.asarray(stages[name]))
        edge = Box(x, y, tile.shape[1], tile.shape[0]).grown(0.5)
        items += [
            Text(x, y - 9, f"{n + 1}  {name}", _TITLE_SIZE, TEXT, bold=0.15),
            Text(x + tile_width, y - 9, values, _DETAIL_SIZE, TEXT_MUTED, "end"),
            Path(edge.corners, _EDGE, closed=True),
        ]
    rows = math.ceil(len(tiles) / columns)
    sheet = paint(Scene(_GAP + columns * cell_width, _GAP + rows * cell_height, tuple(items)))
    for x, y, tile in tiles:
        sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
    return sheet


def _columns(count: int, cell_width: float, cell_height: float) -> int:
    """Return the number of tiles in a row for a sheet of good shape and with few empty cells."""

    def cost(columns: int) -> float:
        rows = math.ceil(count / columns)
        aspect = columns * cell_width / (rows * cell_height)
        return abs(math.log(aspect / _SHEET_ASPECT)) + (rows * columns - count) / count

    return min(range(1, count + 1), key=cost)

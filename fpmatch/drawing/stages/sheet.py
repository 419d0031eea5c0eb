"""All stages of an extraction: each as a picture, and together on one contact sheet."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.drawing.files import png_bytes
from fpmatch.drawing.palette import PANEL_EDGE, TEXT, TEXT_MUTED
from fpmatch.drawing.scene.items import Item, Pen, Scene, Text
from fpmatch.drawing.scene.items import Path as Outline
from fpmatch.drawing.scene.raster import paint
from fpmatch.drawing.stages.pictures import Picture, stage_picture, value_range
from fpmatch.errors import OutputError
from fpmatch.output import atomic_write_bytes, reason

__all__ = ["contact_sheet", "stage_picture", "write_stages"]

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from numpy.typing import NDArray

_TILE_SIDE: Final = 480  # pixels of a tile's longer side, at most
_LEAST_TILE_SIDE: Final = 240  # leaves room for the title
_GAP: Final = 20
_TITLE_HEIGHT: Final = 30
_TITLE_SIZE: Final = 18.0
_DETAIL_SIZE: Final = 13.0
_SHEET_ASPECT: Final = 1.5  # width over height that the grid comes closest to
_EDGE: Final = Pen(PANEL_EDGE, width=1.0)


def contact_sheet(stages: Mapping[str, NDArray[Any]]) -> Picture:
    """Draw all stages on one sheet, in their order, each under its name and range of values.

    Parameters
    ----------
    stages : mapping of str to ndarray
        Arrays by the names of their stages, as `stage_picture` takes them; ``input``, where it is
        among them, lies beneath the others.

    Returns
    -------
    ndarray of uint8, shape (H, W, 3)
        RGB.

    Raises
    ------
    ImageError
        If an array is no picture.
    OutputError
        If there is no stage.

    Examples
    --------
    >>> contact_sheet({"binary": np.eye(40, dtype=bool)}).ndim
    3
    """
    return _sheet(stages, _pictures(stages))


def write_stages(stages: Mapping[str, NDArray[Any]], folder: str | os.PathLike[str]) -> list[Path]:
    """Write each stage as ``01_input.png`` and so on, and ``contact_sheet.png`` with all of them.

    Parameters
    ----------
    stages : mapping of str to ndarray
        As for `contact_sheet`.
    folder : path
        Where to; it is made where it does not exist.

    Returns
    -------
    list of Path
        The files written, the contact sheet last.

    Raises
    ------
    ImageError
        If an array is no picture; nothing is written then.
    OutputError
        If there is no stage, or the folder or a file cannot be written.
    """
    pictures = _pictures(stages)
    named = {
        f"{n:02d}_{_file_stem(name)}.png": p for n, (name, p) in enumerate(pictures.items(), 1)
    }
    named["contact_sheet.png"] = _sheet(stages, pictures)
    encoded = {name: png_bytes(picture) for name, picture in named.items()}
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be made a folder: {reason(error)}") from error
    for name, content in encoded.items():
        atomic_write_bytes(target / name, content)
    return [target / name for name in encoded]


def _pictures(stages: Mapping[str, NDArray[Any]]) -> dict[str, Picture]:
    if not stages:
        raise OutputError("there is no stage to draw")
    beneath = stages.get("input")
    usable = beneath is not None and beneath.dtype == np.uint8 and beneath.ndim == 2
    backdrop = beneath if usable else None
    return {name: stage_picture(name, array, backdrop) for name, array in stages.items()}


def _file_stem(name: str) -> str:
    """Return a stage's name with nothing in it that a file's name cannot hold."""
    return re.sub(r"[^\w-]+", "_", name) or "stage"


def _sheet(stages: Mapping[str, NDArray[Any]], pictures: dict[str, Picture]) -> Picture:
    tile_width, tile_height = _tile_box(next(iter(pictures.values())))
    tiles = [_fitted(picture, (tile_width, tile_height)) for picture in pictures.values()]
    columns = _columns(len(tiles), tile_width + _GAP, tile_height + _GAP + _TITLE_HEIGHT)
    rows = math.ceil(len(tiles) / columns)
    corners = [
        (
            _GAP + (n % columns) * (tile_width + _GAP),
            _GAP + _TITLE_HEIGHT + (n // columns) * (tile_height + _GAP + _TITLE_HEIGHT),
        )
        for n in range(len(tiles))
    ]
    items: list[Item] = []
    for n, ((name, array), (x, y)) in enumerate(zip(stages.items(), corners, strict=True)):
        height, width = tiles[n].shape[:2]
        items += _title(n + 1, name, np.asarray(array), x, y, tile_width)
        items.append(_outline(x, y, width, height))
    sheet = paint(
        Scene(
            _GAP + columns * (tile_width + _GAP),
            _GAP + rows * (tile_height + _GAP + _TITLE_HEIGHT),
            tuple(items),
        )
    )
    for tile, (x, y) in zip(tiles, corners, strict=True):
        sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
    return sheet


def _tile_box(picture: Picture) -> tuple[int, int]:
    """Return the width and height that the first picture, and so every tile, has at most."""
    height, width = picture.shape[:2]
    factor = min(_TILE_SIDE / max(height, width), 1.0)
    return max(round(width * factor), _LEAST_TILE_SIDE), max(round(height * factor), 1)


def _fitted(picture: Picture, box: tuple[int, int]) -> Picture:
    """Return a picture shrunk into `box`, or as it is where it is smaller."""
    height, width = picture.shape[:2]
    factor = min(box[0] / width, box[1] / height)
    if factor >= 1:
        return picture
    size = (max(round(width * factor), 1), max(round(height * factor), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _columns(count: int, cell_width: float, cell_height: float) -> int:
    """Return how many tiles a row takes for a sheet of pleasant shape and well filled."""

    def cost(columns: int) -> float:
        rows = math.ceil(count / columns)
        aspect = columns * cell_width / (rows * cell_height)
        return abs(math.log(aspect / _SHEET_ASPECT)) + (rows * columns - count) / count

    return min(range(1, count + 1), key=cost)


def _title(n: int, name: str, array: NDArray[Any], x: float, y: float, width: float) -> list[Item]:
    return [
        Text(x, y - 9, f"{n}  {name}", _TITLE_SIZE, TEXT, bold=0.15),
        Text(x + width, y - 9, value_range(name, array), _DETAIL_SIZE, TEXT_MUTED, "end"),
    ]


def _outline(x: float, y: float, width: float, height: float) -> Outline:
    left, top, right, bottom = x - 0.5, y - 0.5, x + width + 0.5, y + height + 0.5
    return Outline(((left, top), (right, top), (right, bottom), (left, bottom)), _EDGE, closed=True)

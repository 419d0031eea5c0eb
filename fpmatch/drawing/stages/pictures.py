"""The stages of an extraction, each as a picture, and together on one contact sheet."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np

from fpmatch.base.folders import write_files
from fpmatch.drawing.overlay.marks import MarkStyle, marks
from fpmatch.drawing.scene.ink import shrunk
from fpmatch.drawing.scene.items import Box, Item, Path, Pen, Scene, Text, zoomed
from fpmatch.drawing.scene.palette import PANEL_EDGE, PROBE_MARK, REFERENCE_MARK, TEXT, TEXT_MUTED
from fpmatch.drawing.scene.raster import paint, png_bytes
from fpmatch.errors import ImageError, OutputError
from fpmatch.templates.minutiae import Minutiae, MinutiaKind

if TYPE_CHECKING:
    import os
    import pathlib
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray


Picture: TypeAlias = "NDArray[np.uint8]"

_UNITS: Final = {"orientation": " rad", "period": " px"}
_OUTLIERS: Final = 1.0  # percent of the values at each end that contrast stretching ignores
_FADE: Final = 0.55  # how far a backdrop is bleached towards white
_TINT: Final = (122, 150, 190)  # RGB outside a mask
_SKELETON: Final = (168, 34, 28)
_UNKNOWN: Final = (255, 255, 255)  # where a field is not finite
_MARK_ZOOM: Final = 2  # magnification of the picture of the minutiae
_NEEDLE_STEP: Final = 12  # pixels between the needles of an orientation field
_NEEDLE: Final = Pen((20, 20, 20), width=1.3)
_NEEDLE_HALF: Final = 4.5  # of their length
_HUES: Final = 180  # OpenCV's full circle of hue
_PALE: Final = 95  # saturation, of 255, of an orientation's colour
_ENDING: Final = MarkStyle(Pen(REFERENCE_MARK, width=2.4, halo=1.4), 7.0, 11.0, "ending")
_BIFURCATION: Final = MarkStyle(Pen(PROBE_MARK, width=2.4, halo=1.4), 7.0, 11.0, "bifurcation")


def stage_picture(name: str, array: NDArray[Any], backdrop: Picture | None = None) -> Picture:
    """Draw the array of one stage, with its contrast stretched where its name is unknown.

    The array is (H, W) or (H, W, 3), NaN where unknown; orientations are in radians,
    counter-clockwise from +x. ``minutiae`` are rows of x, y, angle, kind, quality. `backdrop` is
    the print beneath masks, orientations, skeletons and minutiae. The picture is RGB, of the
    array's own size; of minutiae, twice that of the backdrop. Raises ImageError if the array is
    that of no picture.
    """
    values = np.asarray(array)
    if name == "minutiae":
        if values.ndim != 2 or values.shape[1] != 5:
            raise ImageError(f"stage {name}: expected shape (N, 5), not {values.shape}")
        return _minutiae(Minutiae(*values.T), backdrop)
    if values.ndim == 3 and values.shape[2] == 3 and values.dtype == np.uint8 and values.size:
        return np.ascontiguousarray(values)
    if values.ndim != 2 or values.size == 0 or values.dtype.kind not in "biuf":
        raise ImageError(
            f"stage {name}: an array of {values.dtype} and shape {values.shape} is no picture"
        )
    beneath = backdrop if backdrop is not None and backdrop.shape == values.shape else None
    return _PICTURES.get(name, _stretched)(values, beneath)


def value_range(name: str, array: NDArray[Any]) -> str:
    """Return the range of a stage's values, or its number of minutiae, as text."""
    values = np.asarray(array)
    if name == "minutiae":
        return f"{len(values)} found"
    if values.dtype == bool:
        return f"{100 * float(values.mean()):.0f} % set"
    known = values[np.isfinite(values)]
    if not known.size:
        return "no values"
    digits = ".2f" if np.issubdtype(values.dtype, np.floating) else "d"
    return f"{known.min():{digits}} to {known.max():{digits}}{_UNITS.get(name, '')}"


def _grey_to_rgb(grey: Picture) -> Picture:
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB), dtype=np.uint8)


def _faded(backdrop: Picture) -> Picture:
    """Return a backdrop bleached, so that drawings over it are clear."""
    pale = backdrop + (255 - backdrop.astype(np.float32)) * _FADE
    return _grey_to_rgb(np.rint(pale).astype(np.uint8))


def _levels(values: NDArray[Any]) -> tuple[Picture, NDArray[np.bool_]]:
    """Return values scaled to 0..255 between their outliers, and which of them are finite."""
    levels = np.zeros(values.shape, dtype=np.uint8)
    known = np.isfinite(values)
    if known.any():
        finite = values[known].astype(np.float64)
        finite /= np.abs(finite).max() or 1.0  # so that no difference overflows
        low, high = np.percentile(finite, [_OUTLIERS, 100 - _OUTLIERS])
        if high <= low:
            low, high = finite.min(), finite.max()
        levels[known] = np.rint(255 * np.clip((finite - low) / ((high - low) or 1.0), 0, 1))
    return levels, known


def _as_it_is(values: NDArray[Any], beneath: Picture | None) -> Picture:
    return _grey_to_rgb(values) if values.dtype == np.uint8 else _stretched(values, beneath)


def _stretched(values: NDArray[Any], _: Picture | None) -> Picture:
    if values.dtype == bool:
        return _ridges(values, None)
    levels, known = _levels(values)
    picture = _grey_to_rgb(levels)
    picture[~known] = _UNKNOWN
    return picture


def _darkness(values: NDArray[Any], _: Picture | None) -> Picture:
    """Draw a field that is high on ridges with high values dark, as ridges are."""
    return _grey_to_rgb(255 - _levels(values)[0])


def _graded(values: NDArray[Any], _: Picture | None) -> Picture:
    """Draw a field of magnitudes from dark blue over green to yellow."""
    levels, known = _levels(values)
    picture = np.ascontiguousarray(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS)[..., ::-1])
    picture[~known] = _UNKNOWN
    return np.asarray(picture, dtype=np.uint8)


def _ridges(values: NDArray[Any], _: Picture | None) -> Picture:
    """Draw true values in black on white."""
    return _grey_to_rgb(np.where(values.astype(bool), 0, 255).astype(np.uint8))


def _mask(values: NDArray[Any], beneath: Picture | None) -> Picture:
    """Draw the print, tinted outside the mask."""
    outside = ~values.astype(bool)
    picture = _grey_to_rgb(np.full(values.shape, 255, np.uint8) if beneath is None else beneath)
    left_out = picture[outside].astype(np.float32)
    picture[outside] = np.rint(0.35 * left_out + 0.65 * np.array(_TINT)).astype(np.uint8)
    return picture


def _skeleton(values: NDArray[Any], beneath: Picture | None) -> Picture:
    if beneath is None:
        return _ridges(values, None)
    picture = _faded(beneath)
    picture[values.astype(bool)] = _SKELETON
    return picture


def _orientation(values: NDArray[Any], beneath: Picture | None) -> Picture:
    """Draw orientations as hues and as needles, over the print."""
    angle = values.astype(np.float64)
    known = np.isfinite(angle)
    half_turns = np.mod(np.nan_to_num(angle), math.pi) / math.pi
    hsv = np.full((*angle.shape, 3), (0, _PALE, 255), dtype=np.uint8)
    hsv[:, :, 0] = np.minimum(half_turns * _HUES, _HUES - 1).astype(np.uint8)
    picture = np.full((*angle.shape, 3), 255, np.uint8) if beneath is None else _faded(beneath)
    colour = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB).astype(np.float32) / 255
    picture[known] = np.rint(picture[known] * colour[known]).astype(np.uint8)
    start = _NEEDLE_STEP // 2
    needles = []
    for y, x in np.argwhere(known[start::_NEEDLE_STEP, start::_NEEDLE_STEP]) * _NEEDLE_STEP + start:
        dx, dy = math.cos(angle[y, x]) * _NEEDLE_HALF, -math.sin(angle[y, x]) * _NEEDLE_HALF
        ends = ((x + 0.5 - dx, y + 0.5 - dy), (x + 0.5 + dx, y + 0.5 + dy))
        needles.append(Path(ends, _NEEDLE))
    return paint(Scene(values.shape[1], values.shape[0], tuple(needles)), picture)


def _minutiae(minutiae: Minutiae, backdrop: Picture | None) -> Picture:
    """Draw minutiae over the print: endings as circles, bifurcations as squares."""
    if backdrop is None:
        right, bottom = minutiae.xy.max(axis=0, initial=0.0)
        backdrop = np.full((int(bottom) + 1, int(right) + 1), 255, dtype=np.uint8)
    height, width = backdrop.shape[0] * _MARK_ZOOM, backdrop.shape[1] * _MARK_ZOOM
    large = cv2.resize(_faded(backdrop), (width, height), interpolation=cv2.INTER_CUBIC)
    matrix = zoomed(_MARK_ZOOM, (-0.5, -0.5), (0.0, 0.0))
    forked = minutiae.kind == MinutiaKind.BIFURCATION
    endings = marks(minutiae, np.flatnonzero(~forked).tolist(), matrix, _ENDING)
    forks = marks(minutiae, np.flatnonzero(forked).tolist(), matrix, _BIFURCATION)
    return paint(Scene(width, height, (*endings, *forks)), np.asarray(large, dtype=np.uint8))


_PICTURES: Final[dict[str, Callable[[NDArray[Any], Picture | None], Picture]]] = {
    "input": _as_it_is,
    "normalised": _darkness,
    "mask": _mask,
    "orientation": _orientation,
    "coherence": _graded,
    "period": _graded,
    "enhanced": _darkness,
    "binary": _ridges,
    "skeleton": _skeleton,
}


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
    rows = math.ceil(len(pictures) / columns)
    size = (_GAP + rows * cell_height, _GAP + columns * cell_width, 3)
    sheet = np.full(size, 255, np.uint8)
    items: list[Item] = []
    for n, (name, picture) in enumerate(pictures.items()):
        height, width = picture.shape[:2]
        tile = shrunk(picture, min(tile_width / width, tile_height / height))
        x = _GAP + (n % columns) * cell_width
        y = _GAP + _TITLE_HEIGHT + (n // columns) * cell_height
        sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
        values = value_range(name, np.asarray(stages[name]))
        edge = Box(x, y, tile.shape[1], tile.shape[0]).grown(0.5)
        items += [
            Text(x, y - 9, f"{n + 1}  {name}", _TITLE_SIZE, TEXT, bold=0.15),
            Text(x + tile_width, y - 9, values, _DETAIL_SIZE, TEXT_MUTED, "end"),
            Path(edge.corners, _EDGE, closed=True),
        ]
    return paint(Scene(size[1], size[0], tuple(items)), sheet)


def _columns(count: int, cell_width: float, cell_height: float) -> int:
    """Return the number of tiles in a row for a sheet of good shape and with few empty cells."""

    def cost(columns: int) -> float:
        rows = math.ceil(count / columns)
        aspect = columns * cell_width / (rows * cell_height)
        return abs(math.log(aspect / _SHEET_ASPECT)) + (rows * columns - count) / count

    return min(range(1, count + 1), key=cost)

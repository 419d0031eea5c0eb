"""The stages of an extraction, each as a picture."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import cv2
import numpy as np

from fpmatch.base.folders import write_files
from fpmatch.drawing.overlay.page import MarkStyle, marks
from fpmatch.drawing.scene.items import Path, Pen, Scene, zoomed
from fpmatch.drawing.scene.palette import PROBE_MARK, REFERENCE_MARK
from fpmatch.drawing.scene.raster import paint, png_bytes
from fpmatch.errors import ImageError, OutputError
from fpmatch.templates.minutiae import Minutiae, MinutiaKind

if TYPE_CHECKING:
    import os
    import pathlib
    from collections.abc import Mapping

    from numpy.typing import NDArray


Picture: TypeAlias = "NDArray[np.uint8]"

_UNITS: Final = {"orientation": " rad", "period": " px"}
_OUTLIERS: Final = 1.0  # percent of the values at each end that contrast stretching ignores
_FADE: Final = 0.55  # how far a backdrop is bleached towards white
_TINT: Final = np.array((122, 150, 190))  # RGB outside a mask
_SKELETON: Final = (168, 34, 28)
_MARK_ZOOM: Final = 2  # magnification of the picture of the minutiae
_NEEDLE_STEP: Final = 12  # pixels between the needles of an orientation field
_NEEDLE: Final = Pen((20, 20, 20), width=1.3)
_NEEDLE_HALF: Final = 4.5  # of their length
_ENDING: Final = MarkStyle(Pen(REFERENCE_MARK, width=2.4, halo=1.4), 7.0, 11.0, "ending")
_BIFURCATION: Final = MarkStyle(Pen(PROBE_MARK, width=2.4, halo=1.4), 7.0, 11.0, "bifurcation")


def stage_picture(name: str, array: NDArray[Any], backdrop: Picture | None = None) -> Picture:
    """Draw the array of one stage, with its contrast stretched where its name is unknown.

    The array is (H, W), NaN where unknown; orientations are in radians, counter-clockwise from +x.
    ``minutiae`` are rows of x, y, angle, kind, quality. `backdrop` is the print beneath masks,
    orientations, skeletons and minutiae. The picture is RGB, of the array's own size; of minutiae,
    twice that of the backdrop. Raises ImageError if the array is that of no picture.
    """
    values = np.asarray(array)
    if name == "minutiae" and values.ndim == 2 and values.shape[1] == 5:
        return _minutiae(Minutiae(*values.T), backdrop)
    if name == "minutiae" or values.ndim != 2 or not values.size or values.dtype.kind not in "biuf":
        raise ImageError(
            f"stage {name}: an array of {values.dtype} and shape {values.shape} is no picture"
        )
    beneath = np.full(values.shape, 255, np.uint8)
    if backdrop is not None and backdrop.shape == values.shape:
        beneath = backdrop
    if name == "orientation":
        return _needles(values.astype(np.float64), _faded(beneath))
    if name == "mask":
        picture, outside = _grey_to_rgb(beneath), ~values.astype(bool)
        picture[outside] = np.rint(0.35 * picture[outside] + 0.65 * _TINT).astype(np.uint8)
        return picture
    if name == "skeleton":
        picture = _faded(beneath)
        picture[values.astype(bool)] = _SKELETON
        return picture
    if name == "binary" or values.dtype == bool:
        return _grey_to_rgb(np.where(values.astype(bool), 0, 255).astype(np.uint8))
    if name == "input" and values.dtype == np.uint8:
        return _grey_to_rgb(values)
    known = np.isfinite(values)
    levels = _levels(values, known)
    if name in ("normalised", "enhanced"):  # high on ridges, which are drawn dark
        return _grey_to_rgb(255 - levels)
    picture = _grey_to_rgb(levels)
    if name in ("coherence", "period"):  # from dark blue over green to yellow
        coloured = cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS)
        picture = np.asarray(cv2.cvtColor(coloured, cv2.COLOR_BGR2RGB), dtype=np.uint8)
    picture[~known] = 255
    return picture


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
    """Return a backdrop bleached, RGB, so that drawings over it are clear."""
    pale = backdrop + (255 - backdrop.astype(np.float32)) * _FADE
    return _grey_to_rgb(np.rint(pale).astype(np.uint8))


def _levels(values: NDArray[Any], known: NDArray[np.bool_]) -> Picture:
    """Return the known values scaled to 0..255 between their outliers, the others as 0."""
    levels = np.zeros(values.shape, dtype=np.uint8)
    if known.any():
        finite = values[known].astype(np.float64)
        finite /= np.abs(finite).max() or 1.0  # so that no difference overflows
        low, high = np.percentile(finite, [_OUTLIERS, 100 - _OUTLIERS])
        if high <= low:
            low, high = finite.min(), finite.max()
        levels[known] = np.rint(255 * np.clip((finite - low) / ((high - low) or 1.0), 0, 1))
    return levels


def _needles(angle: NDArray[np.float64], beneath: Picture) -> Picture:
    """Draw orientations as needles over the print."""
    known, start = np.isfinite(angle), _NEEDLE_STEP // 2
    needles = []
    for y, x in np.argwhere(known[start::_NEEDLE_STEP, start::_NEEDLE_STEP]) * _NEEDLE_STEP + start:
        dx, dy = math.cos(angle[y, x]) * _NEEDLE_HALF, -math.sin(angle[y, x]) * _NEEDLE_HALF
        ends = ((x + 0.5 - dx, y + 0.5 - dy), (x + 0.5 + dx, y + 0.5 + dy))
        needles.append(Path(ends, _NEEDLE))
    return paint(Scene(angle.shape[1], angle.shape[0], tuple(needles)), beneath)


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


def write_stages(
    stages: Mapping[str, NDArray[Any]], folder: str | os.PathLike[str]
) -> list[pathlib.Path]:
    """Write each stage as ``01_input.png`` and so on; return the files.

    Nothing is written where an array cannot be drawn.
    """
    if not stages:
        raise OutputError("there is no stage to draw")
    beneath = stages.get("input")
    usable = beneath is not None and beneath.dtype == np.uint8 and beneath.ndim == 2
    backdrop = beneath if usable else None
    stems = [re.sub(r"[^\w-]+", "_", name) or "stage" for name in stages]
    files = {
        f"{n:02d}_{stem}.png": png_bytes(stage_picture(name, array, backdrop))
        for n, (stem, (name, array)) in enumerate(zip(stems, stages.items(), strict=True), 1)
    }
    return write_files(files, folder)

"""Sheets of synthetic prints, all at one scale: a column for each sensor, a row for each preset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.drawing.scene.raster import png_bytes
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Grey = NDArray[np.uint8]

DPI: Final = 250.0  # of a sheet: half of what most sensors give
GREYS: Final = 64  # the eye sees no difference, and the file is a third smaller
GAP: Final = 14
SEED: Final = 5
ROWS: Final = 4  # fingers of the sheet of sensors
COLUMNS: Final = 6  # fingers of the sheet of presets
FLAT: Final = ("clean", "easy", "normal", "hard", "stretched")


def synthesis_figures() -> dict[str, bytes]:
    """Return the sheets ``normal.png`` and ``presets.png``."""
    sensors = list(SENSORS)
    normal = [[_print(k, "normal", name) for name in sensors] for k in range(1, ROWS + 1)]
    presets = [[_print(k, name, sensors[0]) for k in range(1, COLUMNS + 1)] for name in FLAT]
    return {"normal.png": png_bytes(sheet(normal)), "presets.png": png_bytes(sheet(presets))}


def sheet(rows: Sequence[Sequence[Grey]]) -> Grey:
    """Return pictures row by row, of fewer grey levels; rows have equal lengths."""
    heights = [max(one.shape[0] for one in row) for row in rows]
    widths = [max(one.shape[1] for one in column) for column in zip(*rows, strict=True)]
    tops, lefts = (np.cumsum([GAP, *(side + GAP for side in sides)]) for sides in (heights, widths))
    page = np.full((tops[-1], lefts[-1]), 255, np.uint8)
    for row, y in zip(rows, tops.tolist(), strict=False):
        for one, x in zip(row, lefts.tolist(), strict=False):
            page[y : y + one.shape[0], x : x + one.shape[1]] = one
    levels = np.rint(page * ((GREYS - 1) / 255))
    return np.asarray(np.rint(levels * (255 / (GREYS - 1))), np.uint8)


def _print(finger: int, preset: str, sensor: str) -> Grey:
    """Return an impression of a finger at the resolution of the sheet."""
    made = make_impression(make_master(SEED, finger), finger, PRESETS[preset], SENSORS[sensor])
    zoom = DPI / made.dpi
    scaled = cv2.resize(made.image, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_AREA)
    return np.asarray(scaled, np.uint8)

"""Further views of two prints: where the ridges agree, and the probe warped through the pairs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.overlay.page import Print, ink_of
from fpmatch.drawing.overlay.ridge_page import agreement
from fpmatch.drawing.overlay.superposed import SIMILARITY, probe_outline, view_of
from fpmatch.drawing.overlay.warp import pair_warp
from fpmatch.drawing.scene.items import Box, bounds, of_transform, zoomed
from fpmatch.drawing.scene.palette import PROBE_INK, hexadecimal
from fpmatch.drawing.scene.raster import data_url, png_bytes
from fpmatch.server.pair import INKED, LARGEST_SIDE_SHOWN, pixels_of, rgba

if TYPE_CHECKING:
    from fpmatch.drawing.overlay.warp import PairWarp
    from fpmatch.matching.verification import Verification
    from fpmatch.prints.pair import ComparedPair
    from fpmatch.server.pair import PairRequest

_COLOURS: Final = 11  # of the scale of agreement
_NODES: Final = 17  # along each side of the probe, for places that an examiner marks


def show_views(request: PairRequest) -> dict[str, Any]:
    """Return what the web interface shows on request; see `fpmatch.server.models.Views`."""
    pair = request.compare()
    warp, drawn = pair_warp(pair.verification)
    return {
        "ridges": _ridges(pair.verification),
        "drawn": drawn if pair.verification.transform else SIMILARITY,
        "warped": None if warp is None else _warped(pair, warp),
    }


def _ridges(verification: Verification) -> dict[str, Any] | None:
    ridges, compared = verification.ridge_map, verification.compared
    if ridges is None or compared is None:
        return None
    document = ridges.as_dict()
    cells = [(*cell, hexadecimal(agreement(cell[2]))) for cell in document["cells"]]
    colours = [hexadecimal(agreement(value)) for value in np.linspace(0, 1, _COLOURS)]
    area = {"area_mm2": compared.ridge_area_mm2}
    return {**document, **area, "cells": cells, "colours": colours}


def _warped(pair: ComparedPair, warp: PairWarp) -> dict[str, Any]:
    v = pair.verification
    probe = Print(pixels_of(pair.probe), v.probe)
    reference = Print(pixels_of(pair.reference), v.reference)
    matrix = of_transform(warp.transform)
    outline = probe_outline(probe, matrix, warp)
    box = bounds(outline).intersection(view_of(reference, outline))
    factor = min(1.0, LARGEST_SIDE_SHOWN / max(box.width, box.height, 1.0))
    size = math.ceil(box.width * factor), math.ceil(box.height * factor)
    to_picture = zoomed(factor, (box.x, box.y), (0.0, 0.0))
    ink = ink_of(probe, to_picture @ matrix, PROBE_INK, "")
    minutiae = warp.minutiae(v.probe.minutiae)
    columns, rows = (
        np.linspace(0, side, _NODES) for side in (v.probe.width - 1, v.probe.height - 1)
    )
    nodes = warp.to_reference(np.stack(np.meshgrid(columns, rows), axis=2).reshape(-1, 2))
    document: dict[str, Any] = {
        "ink": None,
        "box": {"x": box.x, "y": box.y, "width": size[0] / factor, "height": size[1] / factor},
        "extent": [box.x, box.y, box.right, box.bottom],
        "minutiae": [
            [round(float(x), 2), round(float(y), 2), round(float(angle), 4)]
            for x, y, angle in zip(minutiae.x, minutiae.y, minutiae.angle, strict=True)
        ],
        "grid": nodes.reshape(_NODES, _NODES, 2).round(2).tolist(),
    }
    if ink is None:
        return document
    ink = warp.ink(ink, to_picture, Box(0.0, 0.0, *map(float, size)))
    document["ink"] = data_url(png_bytes(rgba(ink.coverage, PROBE_INK)), "png")
    inked = ink.coverage > INKED
    if inked.any():
        right, bottom = (np.flatnonzero(inked.any(axis=axis))[[0, -1]] for axis in (0, 1))
        ends = [right[0], bottom[0], right[1] + 1, bottom[1] + 1]
        starts = [box.x, box.y] * 2
        document["extent"] = [
            start + float(end) / factor for start, end in zip(starts, ends, strict=True)
        ]
    return document

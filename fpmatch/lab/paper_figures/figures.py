"""The paper's Figures 2 to 7, from any point set and the package's own functions.

Figures 1, 3 and 8 of prints are drawn by `python -m research case-study`.
"""

from __future__ import annotations

from functools import partial
from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.lab.paper_figures.flow_chart import flow_chart
from fpmatch.lab.paper_figures.meshes import one_rings, triangulations
from fpmatch.lab.paper_figures.rotation import matched_points, rotation, two_circles
from fpmatch.lab.paper_figures.sheet import draw_sheets
from fpmatch.lab.paper_figures.unit_circle import unit_circle, weights

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.lab.paper_figures.pair import PointPair
    from fpmatch.lab.paper_figures.rings import Ring, RingPair
    from fpmatch.lab.paper_figures.sheet import FileFormat, PointFigure, Sheet


def draw_point_figures(
    pair: PointPair, rings: RingPair, file_format: FileFormat = "svg"
) -> list[PointFigure]:
    """Draw all the figures, in the paper's order; the same sets give the same bytes.

    `rings` are to be shown, as `choose_ring_pair` returns them. An SVG is 800 pixels wide, a PNG
    twice as wide. An `OutputError` is raised if matplotlib is not installed.
    """
    sheets: dict[str, Callable[[], Sheet]] = {
        "figure_2_triangulations": partial(triangulations, pair),
        "figure_3_one_rings": partial(one_rings, rings),
        "figure_4_unit_circle": partial(unit_circle, rings.p),
        "figure_5_weights": partial(weights, rings.p),
        "figure_6a_two_circles": partial(two_circles, rings),
        "figure_6b_rotation": partial(rotation, pair, rings),
        "figure_7_flow_chart": flow_chart,
    }
    return draw_sheets(sheets, file_format)


def numbers_drawn(pair: PointPair, rings: RingPair) -> dict[str, Any]:
    """Return the numbers in the figures, ready for JSON; angles in degrees.

    They are the two rings (centre, points, angles, weights, image, area), the cyclic shift, the
    rotation according to sets, rings, circles and images, and the number of points that match.
    """
    image_rotation = rings.image_rotation
    return {
        "p": _ring_numbers(rings.p),
        "q": _ring_numbers(rings.q),
        "shift": rings.shift,
        "true_shift": rings.true_shift,
        "turn_deg": degrees(rings.turn),
        "rotation_deg": {
            "sets": pair.transform.rotation_deg,
            "rings": rings.transform.rotation_deg,
            "circles": degrees(rings.circle_rotation),
            "images": None if image_rotation is None else degrees(image_rotation),
        },
        "scale": {"sets": pair.transform.scale, "rings": rings.transform.scale},
        "matched": len(matched_points(pair, rings)),
        "points": {"p": len(pair.p.mesh), "q": len(pair.q.mesh)},
    }


def _ring_numbers(ring: Ring) -> dict[str, Any]:
    return {
        "centre": ring.centre,
        "ring": ring.vertex.tolist(),
        "angles_deg": np.degrees(ring.circle.angles).tolist(),
        "weights": ring.circle.weights.tolist(),
        "image": ring.circle.image.tolist(),
        "area": ring.circle.area,
    }

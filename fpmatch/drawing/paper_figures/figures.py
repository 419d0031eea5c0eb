"""Pictures of the paper's Figures 2 to 7, from any point set and the package's own functions.

What the paper shows, and what is drawn here:

- Fig. 2, 3: two sets and their triangulations; one-rings picked out of them;
- Fig. 4: a one-ring mapped to the unit circle, by eq. (3), and its weights, eq. (4);
- Fig. 5: the sub-triangles from which the weights come;
- Fig. 6: the unit circles of two rings that correspond, on a first page; on a second the rotation
  of the points seen as that of the circles, and the overlay that it leads to;
- Fig. 7: the matching algorithm as a flow chart, the same for all sets.

Its Figures 1, 3 and 8 show prints: `fpmatch.drawing.case_study` draws them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.drawing.paper_figures.circle import unit_circle
from fpmatch.drawing.paper_figures.flow_chart import flow_chart
from fpmatch.drawing.paper_figures.meshes import one_rings, triangulations
from fpmatch.drawing.paper_figures.rotation import matched_points, rotation
from fpmatch.drawing.paper_figures.sheet import FILE_FORMATS, settings
from fpmatch.drawing.paper_figures.two_circles import two_circles
from fpmatch.drawing.paper_figures.weights import weights
from fpmatch.errors import OutputError
from fpmatch.output import atomic_write_bytes, reason

if TYPE_CHECKING:
    import os

    from fpmatch.drawing.paper_figures.pair import PointPair
    from fpmatch.drawing.paper_figures.ring import Ring, RingPair
    from fpmatch.drawing.paper_figures.sheet import FileFormat


@dataclass(frozen=True, slots=True)
class PointFigure:
    """Hold one picture.

    Parameters
    ----------
    file_name : str
        Such as ``figure_4_unit_circle.svg``.
    title, caption : str
        The words above and below the panels, which the picture holds as well.
    content : bytes
        The file.
    """

    file_name: str
    title: str
    caption: str
    content: bytes


def draw_point_figures(
    pair: PointPair, rings: RingPair, file_format: FileFormat = "svg"
) -> list[PointFigure]:
    """Draw all the pictures.

    Parameters
    ----------
    pair : PointPair
        The two sets.
    rings : RingPair
        The rings to be shown, as `choose_ring_pair` finds them.
    file_format : {"svg", "png"}
        Vectors 800 pixels wide, or twice as many pixels.

    Returns
    -------
    list of PointFigure
        In the paper's order. The same sets give the same bytes.

    Raises
    ------
    OutputError
        If matplotlib is not installed, or the format is unknown.

    Examples
    --------
    >>> from fpmatch.drawing.paper_figures.pair import random_point_pair
    >>> from fpmatch.drawing.paper_figures.choice import choose_ring_pair
    >>> pair = random_point_pair(1)
    >>> draw_point_figures(pair, choose_ring_pair(pair))[0].file_name
    'figure_2_triangulations.svg'
    """
    if file_format not in FILE_FORMATS:
        raise OutputError(f"unknown format {file_format!r}: expected {' or '.join(FILE_FORMATS)}")
    with settings():
        sheets = {
            "figure_2_triangulations": triangulations(pair),
            "figure_3_one_rings": one_rings(pair, rings),
            "figure_4_unit_circle": unit_circle(rings.p),
            "figure_5_weights": weights(rings.p),
            "figure_6a_two_circles": two_circles(rings),
            "figure_6b_rotation": rotation(pair, rings),
            "figure_7_flow_chart": flow_chart(),
        }
        return [
            PointFigure(
                f"{name}.{file_format}", sheet.title, sheet.caption, sheet.encoded(file_format)
            )
            for name, sheet in sheets.items()
        ]


def write_point_figures(figures: list[PointFigure], folder: str | os.PathLike[str]) -> list[Path]:
    """Write pictures as files, each whole or not at all.

    Parameters
    ----------
    figures : list of PointFigure
        As `draw_point_figures` returns them.
    folder : path-like
        Where to; made where it does not exist.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    OutputError
        If the folder or a file cannot be written.
    """
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be made a folder: {reason(error)}") from error
    for figure in figures:
        atomic_write_bytes(target / figure.file_name, figure.content)
    return [target / figure.file_name for figure in figures]


def numbers_drawn(pair: PointPair, rings: RingPair) -> dict[str, Any]:
    """Return the numbers that the pictures show, ready for JSON; angles in degrees.

    Parameters
    ----------
    pair, rings
        As for `draw_point_figures`.

    Returns
    -------
    dict
        The two rings (centre, points, angles, weights, image, area), the cyclic shift, what sets,
        rings, circles and images say of the rotation, and how many points match.

    Examples
    --------
    >>> from fpmatch.drawing.paper_figures.pair import random_point_pair
    >>> from fpmatch.drawing.paper_figures.choice import choose_ring_pair
    >>> pair = random_point_pair(1)
    >>> round(sum(numbers_drawn(pair, choose_ring_pair(pair))["p"]["weights"]), 12)
    1.0
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

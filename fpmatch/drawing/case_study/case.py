"""All figures of a case study: two prints, and the results of two matchers on them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from fpmatch.drawing.case_study.prints import (
    mesh_of_pairs,
    overlays,
    pairs,
    prints,
    triangulations,
)
from fpmatch.drawing.case_study.rings import ring_of_minutiae, ring_of_pairs
from fpmatch.drawing.case_study.sides import Case, CaseSide
from fpmatch.drawing.paper_figures.sheet import draw_sheets

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.paper_figures.sheet import FileFormat, PointFigure
    from fpmatch.matching.result import Verification


def make_case(
    probe: tuple[str, NDArray[np.uint8]],
    reference: tuple[str, NDArray[np.uint8]],
    default: Verification,
    paper: Verification,
) -> Case:
    """Collect the data of a case study.

    Parameters
    ----------
    probe, reference : (str, ndarray of uint8, shape (H, W))
        Names of the prints, and the pixels of their images.
    default, paper : Verification
        Their comparison by the default matcher and by the paper's, of the same templates.

    Returns
    -------
    Case
        As for `draw_case_study`.
    """
    sides = CaseSide.of("P", *probe, default.probe), CaseSide.of("Q", *reference, default.reference)
    return Case(*sides, default, paper)


def draw_case_study(case: Case, file_format: FileFormat = "png") -> list[PointFigure]:
    """Draw all figures of a case study.

    Parameters
    ----------
    case : Case
        As `make_case` returns it.
    file_format : {"svg", "png"}
        As for `fpmatch.drawing.paper_figures.figures.draw_point_figures`.

    Returns
    -------
    list of PointFigure
        In the order of the steps: prints, triangulations, pairs, mesh of the pairs, a ring of the
        pairs, a ring of all minutiae, overlays. The figure of a ring is missing where no ring of
        one print recurs in the other.

    Raises
    ------
    OutputError
        If matplotlib is not installed, or the format is unknown.
    """
    sheets = {
        "figure_1_prints": prints,
        "figure_3_triangulations": triangulations,
        "pairs": pairs,
        "mesh_of_pairs": mesh_of_pairs,
        "ring_of_pairs": ring_of_pairs,
        "ring_of_minutiae": ring_of_minutiae,
        "figure_8_overlays": overlays,
    }
    return draw_sheets({name: partial(draw, case) for name, draw in sheets.items()}, file_format)

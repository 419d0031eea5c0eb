"""All pictures of a case study, and the numbers that they show."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.drawing.case_study.overlay import overlays
from fpmatch.drawing.case_study.prints import mesh_of_pairs, pairs, prints, triangulations
from fpmatch.drawing.case_study.rings import ring_of_minutiae, ring_of_pairs
from fpmatch.drawing.paper_figures.figures import PointFigure
from fpmatch.drawing.paper_figures.sheet import FILE_FORMATS, settings
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from fpmatch.drawing.case_study.case import Case
    from fpmatch.drawing.paper_figures.sheet import FileFormat


def draw_case_study(case: Case, file_format: FileFormat = "png") -> list[PointFigure]:
    """Draw all pictures of a case study.

    Parameters
    ----------
    case : Case
        As `fpmatch.drawing.case_study.case.make_case` puts it together.
    file_format : {"svg", "png"}
        As for `fpmatch.drawing.paper_figures.figures.draw_point_figures`.

    Returns
    -------
    list of PointFigure
        In the order of the steps: prints, triangulations, pairs, mesh of the pairs, a ring of the
        pairs, a ring of all minutiae, overlays. Where no ring of one print comes again in the
        other, its picture is missing.

    Raises
    ------
    OutputError
        If matplotlib is not installed, or the format is unknown.
    """
    if file_format not in FILE_FORMATS:
        raise OutputError(f"unknown format {file_format!r}: expected {' or '.join(FILE_FORMATS)}")
    with settings():
        sheets = {
            "figure_1_prints": prints(case),
            "figure_3_triangulations": triangulations(case),
            "pairs": pairs(case),
            "mesh_of_pairs": mesh_of_pairs(case),
            "ring_of_pairs": ring_of_pairs(case),
            "ring_of_minutiae": ring_of_minutiae(case),
            "figure_8_overlays": overlays(case),
        }
        return [
            PointFigure(
                f"{name}.{file_format}", sheet.title, sheet.caption, sheet.encoded(file_format)
            )
            for name, sheet in sheets.items()
            if sheet is not None
        ]

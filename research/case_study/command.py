"""The command ``case-study``, and its figures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import click

from fpmatch.drawing.paper_figures.sheet import (
    FILE_FORMATS,
    PointFigure,
    draw_sheets,
    write_point_figures,
)
from fpmatch.errors import DatasetError
from fpmatch.evaluation.databases.dataset import load_dataset
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.matching.verify import verify
from research.case_study.case import Case
from research.case_study.prints import mesh_of_pairs, overlays, pairs, prints, triangulations
from research.case_study.rings import ring_of_minutiae, ring_of_pairs
from research.commands import PATH, ROOT, Command

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.drawing.paper_figures.sheet import FileFormat

SAMPLES: Final = ROOT / "sample_data"
SHOWN: Final = ("103_1", "103_2")
"""The pair of the sample prints that docs/tutorial/case_study.md shows."""


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research case-study fvc/fvc2002/DB1_B --pair 103_1 103_2
""",
)
@click.argument("folder", metavar="[DIR]", type=PATH, default=SAMPLES)
@click.option("--pair", nargs=2, metavar="FFF_M FFF_M", help="Names of two prints.")
@click.option("--out", type=PATH, default="case_study", show_default=True, help="Output folder.")
@click.option("--format", "file_format", type=click.Choice(FILE_FORMATS), default="png")
def command(folder: Path, pair: tuple[str, str] | None, out: Path, file_format: FileFormat) -> None:
    """Draw the paper's case study (section 4.1) and its Figures 1, 3 and 8 on two prints.

    DIR is an FVC-style database, by default the sample prints. Without --pair, the first two
    impressions of its first finger are taken. The pictures are: both prints with their minutiae
    (Figure 1), the triangulations (Figure 3), the pairs by the default and by the paper's matcher,
    the mesh of the pairs, a one-ring of each print on the unit circle, and P over Q by either
    matcher (Figure 8).
    """
    figures = case_study(folder, pair or (), file_format)
    for path, figure in zip(write_point_figures(figures, out), figures, strict=True):
        click.echo(f"{path}: {figure.title}")


def case_study(
    folder: Path, names: tuple[str, ...], file_format: FileFormat = "png"
) -> list[PointFigure]:
    """Extract and compare two prints of a folder, and draw all steps."""
    dataset = load_dataset(folder)
    path = {impression.path.stem: impression.path for impression in dataset.impressions}
    missing = [name for name in names if name not in path]
    if missing:
        raise DatasetError(f"{folder}: contains no print {missing[0]}")
    if not names:
        first = [i for i in dataset.impressions if i.finger == dataset.impressions[0].finger]
        shown = folder.resolve() == SAMPLES.resolve()
        names = SHOWN if shown else tuple(i.path.stem for i in first[:2])
    if len(names) < 2:
        raise DatasetError(f"{folder}: contains one impression of its first finger")
    images = [read_image(path[name]) for name in names]
    templates = [extract(image, dpi=dataset.dpi or image.dpi) for image in images]
    default, paper = verify(*templates), verify(*templates, matcher="paper")
    pixels = [image.pixels for image in images]
    probe, reference = zip(names, pixels, strict=True)
    return draw_case_study(Case.of(probe, reference, default, paper), file_format)


def draw_case_study(case: Case, file_format: FileFormat = "png") -> list[PointFigure]:
    """Draw all figures, in the order of the steps.

    The figure of a ring is missing where no ring of one print recurs in the other.
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

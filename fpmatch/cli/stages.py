"""`fpmatch stages`: look at every stage of an extraction."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fpmatch.cli.enhance import enhance_option
from fpmatch.cli.polarity import polarity_option
from fpmatch.cli.raw import raw_option
from fpmatch.cli.reading import read
from fpmatch.cli.resolution import ResolutionChoice

if TYPE_CHECKING:
    from fpmatch.image.io.raw import RawSize


@click.command(
    epilog="""\b
Examples:
  fpmatch stages print.tif -o stages
  fpmatch stages print.png -o stages --dpi 1000
  fpmatch stages print.tif -o stages --enhance filters
"""
)
@click.argument("image", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for the pictures; made if missing.",
)
@click.option("--dpi", type=float, help="Resolution of the image, in dots per inch.")
@polarity_option
@enhance_option
@raw_option
def stages(
    image: Path,
    output: Path,
    dpi: float | None,
    polarity: str,
    enhance: str,
    raw: tuple[RawSize, ...],
) -> None:
    """Write what each stage of the extraction makes of IMAGE, and one sheet of them all."""
    from fpmatch.drawing.stages.sheet import write_stages
    from fpmatch.image.extract import extract
    from fpmatch.image.recorder import StageRecorder

    picture = read(image, raw, polarity=polarity, dpi=dpi)
    recorder = StageRecorder()
    resolution = ResolutionChoice().of(picture, dpi)
    template = extract(picture, resolution, enhance=enhance, recorder=recorder)
    write_stages(recorder.stages, output)
    click.echo(f"{len(recorder.stages)} stages, {len(template.minutiae)} minutiae: {output}")

"""`fpmatch stages`: look at every stage of an extraction."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fpmatch.cli.raw import raw_option
from fpmatch.cli.reading import read
from fpmatch.cli.resolution import ResolutionChoice

if TYPE_CHECKING:
    from fpmatch.image.raw import RawSize


@click.command(
    epilog="""\b
Examples:
  fpmatch stages print.tif -o stages
  fpmatch stages print.png -o stages --dpi 1000
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
@raw_option
def stages(image: Path, output: Path, dpi: float | None, raw: tuple[RawSize, ...]) -> None:
    """Write what each stage of the extraction makes of IMAGE, and one sheet of them all."""
    from fpmatch.drawing.stage_sheet import write_stages
    from fpmatch.image.extract import extract
    from fpmatch.image.recorder import StageRecorder

    picture = read(image, raw)
    recorder = StageRecorder()
    template = extract(picture, ResolutionChoice().of(picture, dpi), recorder=recorder)
    write_stages(recorder.stages, output)
    click.echo(f"{len(recorder.stages)} stages, {len(template.minutiae)} minutiae: {output}")

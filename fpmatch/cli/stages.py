"""`fpmatch stages`: every stage of an extraction as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_notes_on, show_line
from fpmatch.cli.options import FILE, enhance_option, output_option, polarity_option, raw_option
from fpmatch.printable import count

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch stages print.tif -o stages
  fpmatch stages print.png -o stages --dpi 1000
  fpmatch stages print.tif -o stages --enhance filters
""",
)
@click.argument("image", type=FILE)
@output_option(metavar="DIR", help="Folder for the pictures; made if missing.")
@click.option("--dpi", type=float, help="Resolution of the image, in dots per inch.")
@polarity_option
@enhance_option
@raw_option
def stages(
    image: Path,
    output: Path,
    dpi: float | None,
    polarity: Polarity,
    enhance: str,
    raw: tuple[RawSize, ...],
) -> None:
    """Write the result of each stage of the extraction of IMAGE, and one sheet of them all."""
    from fpmatch.drawing.stages.sheet import write_stages
    from fpmatch.image.preprocess.arrays import StageRecorder
    from fpmatch.prints.reading import PrintReader, make_given_print

    content = PrintReader(raw, quiet=True).image(image, polarity=polarity, dpi=dpi)
    recorder = StageRecorder()
    given = make_given_print(content, str(image), dpi=dpi, enhance=enhance, recorder=recorder)
    say_notes_on([given])
    write_stages(recorder.stages, output)
    minutiae = count(len(given.template.minutiae), "minutia", "minutiae")
    show_line(f"{len(recorder.stages)} stages, {minutiae}: {output}")

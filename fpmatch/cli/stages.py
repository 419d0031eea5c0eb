"""`fpmatch stages`: every stage of an extraction as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_notes_on, show_line
from fpmatch.cli.options import FILE, enhance_option, output_option, reading_options
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
@reading_options
@enhance_option
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
    from fpmatch.prints.reading import PrintReader, read_given_print

    recorder, reader = StageRecorder(), PrintReader(raw, quiet=True)
    how: dict[str, Any] = {"polarity": polarity, "dpi": dpi, "enhance": enhance}
    given = read_given_print(image, reader.image, **how, recorder=recorder)
    say_notes_on([given])
    write_stages(recorder.stages, output)
    minutiae = count(len(given.template.minutiae), "minutia", "minutiae")
    show_line(f"{len(recorder.stages)} stages, {minutiae}: {output}")

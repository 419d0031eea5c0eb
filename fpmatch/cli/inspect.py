"""`fpmatch inspect`: what files contain, a line each."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.given_files import given_files
from fpmatch.cli.notes import say_errors, show, show_line
from fpmatch.cli.options import (
    PRINT,
    RECORD,
    files_argument,
    json_array_option,
    reading_options,
)
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch inspect print.tif template.iso
  fpmatch inspect prints --json
  fpmatch inspect small_sensor.bmp --dpi 240
  fpmatch inspect - < print.tif

Exit status: 0 when every file is known, 1 when some are unknown or damaged, 2 when all are.
""",
)
@files_argument("places", metavar="FILE|DIR...", type=PRINT)
@reading_options
@RECORD
@json_array_option
def inspect(
    places: tuple[Path, ...],
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    record: int | None,
    as_json: bool,
) -> int:
    """Show what each FILE contains: format, size, resolution, minutiae, quality, anomalies.

    Of DIR, its images are shown or, if it has none, its templates, else the prints of its
    subfolders.

    The quality of an image is 0, useless, to 100; what is wrong with it follows, as a resolution
    that cannot be right, and which one is likely.

    Images and templates are recognised by content, not by name. The polarity of the images of one
    folder is detected from all of them. The prints of one file are separated by bars.
    """
    from fpmatch.cli.inspection import inspect_file
    from fpmatch.prints.reading import PrintReader

    reader = PrintReader(raw, quiet=True, record=record).image
    files = given_files(places, reader, polarity=polarity, dpi=dpi)
    documents: list[dict[str, Any]] = []
    failures = 0
    with ProgressBars({"inspect": "inspecting"}) as bars:
        for number, file in enumerate(files, start=1):
            if as_json or not sys.stdout.isatty():  # else the lines show how far it is
                bars.show("inspect", number, len(files))
            try:
                document, line = inspect_file(file.path, image_reader=file.read, dpi=file.dpi)
            except FpmatchError as error:
                failures += 1
                say_errors([error])
                continue
            documents.append(document)
            if not as_json:
                show_line(line)
    if as_json:
        show(json_text(documents))
    return 0 if not failures else 1 if documents else 2

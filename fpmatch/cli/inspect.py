"""`fpmatch inspect`: what files contain, a line each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_errors, show, show_line
from fpmatch.cli.options import (
    PRINT,
    RECORD,
    files_argument,
    json_array_option,
    key_option,
    reading_options,
)
from fpmatch.errors import FpmatchError
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.cli.inspection import Inspection
    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch inspect print.tif template.iso
  fpmatch inspect prints/* --json
  fpmatch inspect small_sensor.bmp --dpi 240
  fpmatch inspect - < print.tif

Exit status: 0 when every file is known, 1 when some are unknown or damaged, 2 when all are.
""",
)
@files_argument("files", metavar="FILE...", type=PRINT)
@reading_options
@RECORD
@json_array_option
@key_option
def inspect(
    files: tuple[Path, ...],
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    record: int | None,
    as_json: bool,
) -> int:
    """Show what each FILE contains: format, size, resolution, minutiae, quality, anomalies.

    The quality of an image is 0, useless, to 100; what is wrong with it follows, as a resolution
    that cannot be right, and which one is likely.

    Images and templates are recognised by content, not by name. The polarity of the images of one
    folder is detected from all of them. Where a file contains several prints, what differs between
    them is separated by bars.
    """
    from fpmatch.cli.inspection import inspect_file
    from fpmatch.image.dataset_folder import described
    from fpmatch.image.folder_traits import FolderReader, find_traits
    from fpmatch.prints.reading import PrintReader
    from fpmatch.templates.minutiae import check_dpi

    reader = PrintReader(raw, quiet=True, record=record).image
    if dpi is not None:
        check_dpi(dpi)
    traits = find_traits(files, polarity=polarity, dpi=dpi, reader=reader)
    image_reader = FolderReader(reader, traits, dpi)
    inspections: list[Inspection] = []
    failures = 0
    for file in files:
        try:
            _, own_dpi = described(file, dpi=dpi)
            inspection = inspect_file(file, image_reader=image_reader, dpi=own_dpi)
        except FpmatchError as error:
            failures += 1
            say_errors([error])
            continue
        inspections.append(inspection)
        if not as_json:
            show_line(inspection.as_text())
    if as_json:
        show(json_text([inspection.as_dict() for inspection in inspections]))
    return 0 if not failures else 1 if inspections else 2

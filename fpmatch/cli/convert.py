"""`fpmatch convert`: a template in another format."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_notes, show_line
from fpmatch.cli.options import (
    FILE,
    PRINT,
    FormatChoice,
    angles_option,
    image_size,
    reading_options,
)
from fpmatch.formats.registry import CODECS, codec_of_name, codec_of_suffix, written_formats
from fpmatch.printable import count

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.formats.record import AngleConvention, TemplateRecord
    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    details="""\b
Formats, with their suffixes:
  json .json       fpmatch's own, complete and exact
  csv .csv         fpmatch's own, to be read by people and spreadsheets
  minutiae-csv     x, y, theta, type, quality and no comments, for other programs
  iso2005 .iso     ISO/IEC 19794-2:2005; .ist and .fmr as well
  ansi2004 .ansi   ANSI/INCITS 378-2004
  xyt .xyt         NIST's, as mindtct writes: y up, degrees, opposite direction
  xyt-m1 .xyt-m1   as mindtct -m1 writes: y down, units of two degrees
  numbers          rows of x, y, angle, as np.savetxt writes: only read, with --angles
  npy              the same as np.save writes
  iso2011          ISO/IEC 19794-2:2011: only read
  ansi2009         ANSI/INCITS 378-2009, with its amendment 1: only read
  an2              ANSI/NIST-ITL, type 9: only read
  and those of other packages, see docs/how-to/add_a_format.md

\b
What does not fit:
  Minutiae outside the print are dropped; of too many, those of lowest quality first. Each loss is
  a note on stderr.
""",
    epilog="""\b
Examples:
  fpmatch convert print.json print.iso
  fpmatch convert card.an2 print.dat --format ansi2004 --record 2
  fpmatch convert print.xyt print.json --size 388x374 --dpi 500
  fpmatch convert minutiae.npy print.json --angles rad,clockwise --size 388x374 --dpi 500
  fpmatch convert print.tif print.iso
  fpmatch convert - print.iso < print.json
""",
)
@click.argument("source", metavar="IN", type=PRINT)
@click.argument("target", metavar="OUT", type=FILE)
@click.option(
    "--format",
    "file_format",
    type=FormatChoice(written_formats()),
    help="Format of OUT.  [default: by its suffix]",
)
@click.option(
    "--from",
    "source_format",
    type=FormatChoice([codec.name for codec in CODECS]),
    hidden=True,
    help="Format of IN.  [default: by its content]",
)
@click.option(
    "--record",
    type=click.IntRange(min=1),
    help="Write this print of IN only, from 1.",
)
@reading_options
@click.option(
    "--size",
    metavar="WxH",
    type=image_size,
    help="Size of IN in pixels, where the file does not contain it.",
)
@angles_option
def convert(
    source: Path,
    target: Path,
    file_format: str | None,
    source_format: str | None,
    record: int | None,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    size: RawSize | None,
    angles: AngleConvention | None,
) -> None:
    """Write the template IN, or that of the image IN, as OUT in another format.

    The format of IN is found by its content. All its prints are kept where the format of OUT can
    hold several.
    """
    from fpmatch.base.output import check_writable
    from fpmatch.formats.files import save_record
    from fpmatch.formats.record import TemplateRecord, View
    from fpmatch.image.dataset_folder import folder_settings
    from fpmatch.prints.reading import PrintReader, content_of, read_given_print

    codec = codec_of_name(file_format) if file_format else codec_of_suffix(target)
    check_writable(target)
    if source_format or content_of(source) in {"template", "both"}:
        _, stated_dpi = folder_settings(source, dpi=dpi)
        prints = _template(source, source_format, stated_dpi, size, angles)
        prints = prints if record is None else prints.of_view(record, source)
    else:
        given = read_given_print(
            source, PrintReader(raw, quiet=True, record=record).image, polarity=polarity, dpi=dpi
        )
        prints = TemplateRecord("", (View(given.template),), given.notes)
    notes = save_record(target, prints, file_format=codec.name)
    for path, texts in [(source, prints.notes), (target, notes)]:
        say_notes({note: [path] for note in texts})
    minutiae = sum(len(print_.template.minutiae) for print_ in prints.views)
    several = "" if len(prints.views) == 1 else f"{len(prints.views)} prints, "
    show_line(f"{target}: {codec.title}, {several}{count(minutiae, 'minutia', 'minutiae')}")


def _template(
    path: Path,
    file_format: str | None,
    dpi: float | None,
    size: RawSize | None,
    angles: AngleConvention | None,
) -> TemplateRecord:
    """Return the record of a template file, at `dpi` where that is given."""
    from fpmatch.formats.files import load_record
    from fpmatch.formats.record import ReadingOptions
    from fpmatch.prints.reading import ASSUMED_DPI
    from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi

    sides = None if size is None else (size.width, size.height)
    options = ReadingOptions(STANDARD_DPI if dpi is None else check_dpi(dpi), sides, angles)
    record = load_record(path, file_format=file_format, options=options)
    views = tuple(view.at(dpi) for view in record.views)
    first, notes = views[0].template, list(record.notes)
    if not all(view.dpi_known for view in views):
        notes.append(ASSUMED_DPI)
    if size is None and not all(view.size_known for view in views):
        notes.append(
            f"size unknown; {first.width} x {first.height} px assumed, which the minutiae span "
            "(--size sets it)"
        )
    return replace(record, views=views, notes=tuple(notes))

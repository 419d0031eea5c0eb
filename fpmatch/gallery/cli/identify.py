"""`fpmatch identify`: the enrolled prints that match a probe best."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.options import (
    MIRROR,
    PRINT,
    file_option,
    files_argument,
    json_option,
    matcher_option,
    reading_options,
)
from fpmatch.gallery.cli.options import (
    FROM_1,
    check_where,
    key_option,
    scheduler_option,
)

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    details="""
The index of a large GALLERY is made by the first search, and extended by the first one after a
change. A manifest of probes is as for fpmatch enrol.

\b
Columns:
  score      -10 log10 of the FMR, 0 to 100; of a finger, from all its impressions together
  FMR        share of comparisons with other fingers, of as many impressions, that score as high
  by chance  number of searched fingers expected to score as high if the finger is not enrolled,
             by the FMR, or if fewer, by the scores of the others
  print      subject, finger and impression: of a subject its best finger, of a finger its most
             similar impression
  number     of the entry, as `fpmatch gallery list` shows it
  picture    that was enrolled

\b
More examples:
  fpmatch identify prints.db manifest.csv
  fpmatch identify postgresql://me@host/prints probe.tif --transform
  fpmatch identify prints.db - < probe.tif
  fpmatch identify prints.db probe.tif --all
  fpmatch identify nation.db probe.tif --effort 4
  fpmatch identify people.db left.png --with right.png

\b
Many probes, on all cores or on a cluster (columns of the file: docs/how-to/batches.md):
  fpmatch identify prints.db --probes seized -o candidates.jsonl --transform
  fpmatch identify prints.db --probes seized -o candidates.csv --scheduler tcp://host:8786
""",
    epilog="""\b
Examples:
  fpmatch identify prints.db probe.tif
  fpmatch identify prints.db probes -k 3 --threshold 40 --json
  fpmatch identify prints.db --probes seized -o candidates.csv

Exit status: 0 when every probe was searched for, 1 when some could not be read, 2 when none could.
""",
)
@click.argument("gallery")
@files_argument("probes", metavar="[PROBE]...", required=False, type=PRINT)
@file_option(
    "--probes",
    "more_probes",
    metavar="DIR|MANIFEST|FILE",
    multiple=True,
    help="Search for these prints, too; repeatable.",
)
@file_option(
    "-o",
    "--output",
    metavar="OUT.csv|.jsonl",
    help="Write the candidates of all probes to this file: CSV, a row each, or JSON lines, a "
    "document a probe. An interrupted run is resumed by the same command.",
)
@click.option(
    "-k", "count", metavar="N", type=FROM_1, default=10, help="List N candidates at most."
)
@click.option(
    "--threshold",
    type=float,
    metavar="SCORE",
    default=0.0,
    show_default=False,
    help="Omit candidates with a lower score, 0 to 100; this command ranks and does not decide.",
)
@click.option(
    "--transform",
    "transforms",
    is_flag=True,
    hidden=True,
    help="Show the transform to each candidate.",
)
@click.option(
    "--all",
    "all_fingers",
    is_flag=True,
    help="List all fingers, not each subject once with the best of its fingers.",
)
@file_option(
    "--with",
    "others",
    metavar="SECOND",
    multiple=True,
    help="Search for the subject whose fingers match PROBE and SECOND, a print of another of the "
    "subject's fingers, best together; repeatable. A manifest may name the finger of each.",
)
@reading_options
@MIRROR
@matcher_option
@file_option(
    "--calibration",
    metavar="FILE",
    hidden=True,
    help="Score as fitted by fpmatch calibrate to prints of your own.",
)
@click.option(
    "--effort",
    type=click.Choice(["1", "2", "4"]),
    default="1",
    callback=lambda ctx, param, value: int(value),
    hidden=True,
    help="How many prints of a gallery of more than 2,000 are compared: the more, the fewer "
    "matching ones are missed.",
)
@json_option
@click.option(
    "--workers",
    type=FROM_1,
    help="Processes to use, or threads to search for one probe after the other.  [default: all "
    "cores]",
)
@scheduler_option
@key_option
def identify(
    gallery: str,
    probes: tuple[Path, ...],
    more_probes: tuple[Path, ...],
    output: Path | None,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    mirror: bool,
    matcher: str,
    calibration: Path | None,
    all_fingers: bool,
    others: tuple[Path, ...],
    as_json: bool,
    workers: int | None,
    scheduler: str | None,
    **limits: Any,
) -> int:
    """Rank the subjects of GALLERY by how well they match each PROBE.

    A PROBE is an image, a template, a folder of them, or a manifest. GALLERY is a file that
    `fpmatch enrol` made, or the URL of a PostgreSQL database.
    """
    from fpmatch.gallery.cli import identify_runs as runs
    from fpmatch.gallery.listing.prints import find_prints
    from fpmatch.gallery.search.search import SearchOptions
    from fpmatch.matching.calibration import load_calibration
    from fpmatch.matching.registry import matcher_name, states_rho
    from fpmatch.prints.reading import PrintReader

    if states_rho(matcher):
        raise click.UsageError("rho decides on two prints: searches go by scores")
    curve = load_calibration(matcher_name(matcher), calibration)
    places = (*probes, *more_probes)
    if not places:
        raise click.UsageError("Missing argument 'PROBE...', or --probes.")
    check_where(workers, scheduler)
    options = SearchOptions(
        listed="fingers" if all_fingers else "subjects",
        calibration=curve,
        **limits,
    )
    reader = PrintReader(raw, quiet=True, mirror=mirror)
    reading = {"polarity": polarity, "dpi": dpi, "reader": reader}
    where = gallery, matcher, workers, scheduler
    run = runs.Run(*where, places, find_prints(places, dpi), reading, options, as_json)
    if output is not None:
        from fpmatch.gallery.batch.candidates import is_json_lines

        if others:
            raise click.UsageError("-o excludes --with")
        if options.transforms and not is_json_lines(output):
            raise click.UsageError("--transform needs -o OUT.jsonl: CSV has no columns for it")
        return runs.identify_to_file(run, output)
    if scheduler is not None:
        raise click.UsageError("--scheduler goes with -o")
    if others:
        if options.listed != "subjects" or options.transforms:
            raise click.UsageError("--with lists subjects: it excludes --all and --transform")
        return runs.identify_by_fingers(run, find_prints(others, dpi))
    return runs.identify_one_by_one(run)

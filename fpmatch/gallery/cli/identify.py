"""`fpmatch identify`: the enrolled prints that match a probe best."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.options import (
    PRINT,
    dpi_option,
    file_option,
    files_argument,
    json_option,
    matcher_option,
)
from fpmatch.gallery.cli.options import FROM_1, check_where, key_option, scheduler_option

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    cls=Command,
    details="""
The index of a large GALLERY is made by the first search, and extended by the first one after a
change. A manifest of probes is as for fpmatch enrol. Probes that need options to be read (--raw,
--polarity, --mirror) are extracted first: fpmatch extract makes templates of them.

\b
More examples:
  fpmatch identify postgresql://me@host/prints probe.tif
  fpmatch identify people.db left.png --with right.png
  fpmatch identify prints.db --probes seized -o candidates.jsonl --scheduler tcp://host:8786
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
    "--by-chance",
    metavar="X",
    type=click.FloatRange(min=0, min_open=True),
    default=inf,
    show_default=False,
    hidden=True,
    help="Omit candidates of which X others or more are expected by chance: with 0.01, about one "
    "search in a hundred lists a wrong one.",
)
@file_option(
    "--with",
    "others",
    metavar="SECOND",
    multiple=True,
    help="Search for the subject whose fingers match PROBE and SECOND, a print of another of the "
    "subject's fingers, best together; repeatable. A manifest may name the finger of each.",
)
@dpi_option
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
    matcher: str,
    calibration: Path | None,
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
    from fpmatch.matching.registry import get_matcher, states_rho

    if states_rho(matcher):
        raise click.UsageError("rho decides on two prints: searches go by scores")
    curve = load_calibration(get_matcher(matcher).name, calibration)
    places = (*probes, *more_probes)
    if not places:
        raise click.UsageError("Missing argument 'PROBE...', or --probes.")
    check_where(workers, scheduler)
    if output is not None and others:
        raise click.UsageError("-o excludes --with")
    if output is None and scheduler is not None:
        raise click.UsageError("--scheduler goes with -o")
    options = SearchOptions(listed="subjects", calibration=curve, **limits)
    files = find_prints(places, dpi)
    run = runs.Run(gallery, matcher, workers, scheduler, dpi, options, as_json)
    if output is not None:
        return runs.identify_to_file(run, places, files, output)
    if others:
        if len(files) > 1:
            raise click.UsageError(f"--with goes with one PROBE, not with {len(files)}")
        return runs.identify_by_fingers(run, [*files, *find_prints(others, dpi)])
    return runs.identify_one_by_one(run, files)

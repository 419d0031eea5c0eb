"""The command ``compare-prints``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.evaluation.databases.dataset import with_unique_names
from fpmatch.evaluation.run import load_datasets
from research.commands import PATH, Command, folders, json_file, workers, write_json
from research.experiments.image_statistics import (
    format_statistics,
    measure_sets,
    statistics_as_json,
)

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research compare-prints synthetic/* --against fvc/fvc2002/DB1_B --json prints.json
""",
)
@folders
@click.option(
    "--against", metavar="DIR", type=PATH, multiple=True, help="Compare with it (repeatable)."
)
@json_file
@workers
def command(
    folders: tuple[Path, ...],
    against: tuple[Path, ...],
    json_file: Path | None,
    workers: int | None,
) -> None:
    """Compare statistics of the prints of FVC-style databases DIR.

    Ridge period, area, minutiae, grey levels and foreground of every print are measured and their
    distributions shown side by side; with --against, also the share of prints outside the range of
    those databases (from the least 5 % to the greatest 95 %).
    """
    measured = measure_sets(with_unique_names(load_datasets([*folders, *against])), workers=workers)
    sets, others = measured[: len(folders)], measured[len(folders) :]
    click.echo(format_statistics(sets, others))
    for one in measured:
        for reason in one.failures:
            click.echo(reason, err=True)
    if json_file:
        write_json(json_file, statistics_as_json(sets, others))

#!/usr/bin/env python3
"""Count the three outcomes of comparisons of whole prints and of parts of prints.

.venv/bin/python research/benchmarks/outcomes.py DIR... [--json FILE]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import repository  # noqa: F401

from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from research.commands import Command, folders, json_file, workers, write_json
from research.experiments.outcomes import format_outcomes, outcome_rows, ridge_extremes

if TYPE_CHECKING:
    from pathlib import Path


@click.command(cls=Command)
@folders
@click.option("--parts", default=40, show_default=True, help="Of each kind and database.")
@click.option("--seed", default=0, show_default=True)
@json_file
@workers
def command(
    folders: tuple[Path, ...], parts: int, seed: int, json_file: Path | None, workers: int | None
) -> None:
    """Count the outcomes MATCH, NO MATCH and INCONCLUSIVE of genuine and of impostor pairs.

    Each DIR is an FVC-style database. All pairs of its prints are compared, and parts of prints
    with all other prints: some neighbouring minutiae with the ridges around them or without, and
    squares of the images at random places, extracted again. After the table stand the extremes of
    the prints' ridges, by which other pictures are recognised.
    """
    sets = extract_datasets(load_datasets(folders), workers=workers)
    rows = []
    for row in outcome_rows(sets, parts, seed):
        rows.append(row.as_json())
        click.echo(f"{len(rows)}: {row.name}", err=True)
    click.echo(format_outcomes(rows))
    for extracted in sets:
        click.echo(ridge_extremes(extracted))
    if json_file is not None:
        write_json(json_file, {"rows": rows})


if __name__ == "__main__":
    command()

"""The command ``error-vs-discard``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.evaluation.databases.dataset import with_unique_names
from fpmatch.evaluation.run import load_datasets
from research.commands import Command, folders, json_file, workers, write_json
from research.experiments.error_vs_discard import curves_as_json, sample_quality
from research.tables.quality import discard_tables

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  python -m research error-vs-discard fvc/*/* --json fvc.json
  python -m research tables quality --fvc fvc.json
""",
)
@folders
@json_file
@workers
def command(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure the false non-match rate where the worst prints are discarded.

    Prints are discarded in the order of their quality, on FVC-style databases DIR.
    """
    datasets = with_unique_names(load_datasets(folders))
    results = curves_as_json(sample_quality(datasets, workers=workers))
    click.echo(discard_tables(results))
    if json_file:
        write_json(json_file, results)

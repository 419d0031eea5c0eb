#!/usr/bin/env python3
"""Measure what revocable templates cost in error rates and time, and whether two keys are linked.

.venv/bin/python research/benchmarks/revocable.py DIR... [--json FILE]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import repository  # noqa: F401

from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from research.commands import Command, folders, json_file, workers, write_json
from research.experiments.revocable import measure_revocable
from research.tables.revocable import format_revocable

if TYPE_CHECKING:
    from pathlib import Path


@click.command(cls=Command)
@folders
@json_file
@workers
def main(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure revocable templates of the prints of FVC-style databases DIR.

    All impressions of a database are compared, those of one finger as genuine pairs: as revocable
    templates of one key, and by the default matcher. Templates of two random keys are judged by
    each attack; D_sys (ISO/IEC 30136) is 0 where mated and non-mated pairs are judged alike.

    --json writes what ``python -m research tables revocable --measured`` reads.
    """
    found = measure_revocable(extract_datasets(load_datasets(folders), workers=workers))
    click.echo(format_revocable({"measured": found}))
    if json_file:
        write_json(json_file, found)


if __name__ == "__main__":
    main()

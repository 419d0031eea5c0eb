#!/usr/bin/env python3
"""Measure whether the fused scores of two fingers state how often impostors reach them.

.venv/bin/python research/benchmarks/fused_fingers.py DIR... [--json FILE]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import repository  # noqa: F401

from fpmatch.evaluation.report.results import scores_of
from fpmatch.evaluation.run import evaluate
from fpmatch.matching.calibration import load_calibration
from research.commands import Command, folders, json_file, workers, write_json
from research.experiments.fused_fingers import check_fusion
from research.tables.identification import format_fusion

if TYPE_CHECKING:
    from pathlib import Path


@click.command(cls=Command)
@folders
@json_file
@workers
def main(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure whether the fused scores of two fingers state how often impostors reach them.

    Two fingers of a database stand for a subject: neighbouring ones, and fingers five apart.
    """
    report = evaluate(list(folders), workers=workers)
    calibration = load_calibration(report.matcher)
    results = [check_fusion(scores_of(report), calibration, apart) for apart in (1, 5)]
    click.echo(format_fusion(results))
    if json_file is not None:
        write_json(json_file, results)


if __name__ == "__main__":
    main()

"""The command ``check batches``."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from fpmatch.lab.synthesis.sensor import SENSORS
from research.checks.batches import check_batches
from research.commands import Command

SENSOR = SENSORS["optical-388x374"]


@click.command(cls=Command)
@click.option("--prints", default=640, show_default=True, help="Files of each kind.")
@click.option("--workers", default=1, show_default=True, help="Processes that commands use.")
@click.pass_context
def command(context: click.Context, prints: int, workers: int) -> None:
    """Check that commands finish batches with damaged files among them.

    Images of FVC's size and templates are made, one in ten of them damaged, and given to inspect,
    extract, enrol, evaluate and score. Each command must finish, name exactly the damaged files
    and end with the right exit status; otherwise the exit status is 1.
    """
    with tempfile.TemporaryDirectory() as folder:
        verdicts = check_batches(Path(folder), prints, SENSOR, workers=workers)
    for verdict in verdicts:
        words = "; ".join(verdict.faults) or "right"
        click.echo(f"{verdict.command:<20} {verdict.seconds:7.1f} s  {words}")
    context.exit(1 if any(verdict.faults for verdict in verdicts) else 0)

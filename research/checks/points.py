"""The command ``check points``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.lab.points.results import read_results
from research.commands import PATH, Command
from research.experiments.point_targets import missed_targets

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check points docs/data/pointsets_bench.json
""",
)
@click.argument("results", metavar="FILE", type=PATH)
@click.pass_context
def command(context: click.Context, results: Path) -> None:
    """List the results on random point sets that miss their targets.

    FILE is what ``fpmatch points bench --json`` wrote; `research.experiments.point_targets` defines
    the targets. The exit status is 1 if any is missed.
    """
    missed = missed_targets(read_results(results))
    click.echo("\n".join(missed) if missed else "no cell misses a target")
    context.exit(1 if missed else 0)

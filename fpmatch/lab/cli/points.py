"""`fpmatch points`: the commands for bare point sets, each in a module of its own."""

from __future__ import annotations

from typing import Final

import click

from fpmatch.cli.command import LazyGroup

SUMMARIES: Final = {
    "match": "Find the transform between two point sets.",
    "bench": "Repeat the paper's experiment on random point sets.",
}


@click.group(
    cls=LazyGroup,
    summaries=SUMMARIES,
    prefix="fpmatch.lab.cli.points_",
    epilog="""\b
Examples:
  fpmatch points match stars.csv catalogue.csv
  fpmatch points bench --quick
""",
)
def points() -> None:
    """Match and benchmark bare point sets: stars, landmarks, spots on gels."""

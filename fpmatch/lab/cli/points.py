"""`fpmatch points`: the commands for bare point sets, each in a module of its own."""

from __future__ import annotations

from typing import Final

import click

from fpmatch.cli.group import LazyGroup

SUMMARIES: Final = {
    "match": "Find the transform between two point sets.",
    "bench": "Repeat the paper's experiment on random point sets.",
}


class _Points(LazyGroup):
    """The commands, and an answer to the name of one that another command replaced."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the sub-command that is named first."""
        if args[0] == "draw" and not ctx.resilient_parsing:
            ctx.fail("'points draw' is now 'fpmatch explain P.csv Q.csv -o FOLDER'.")
        return super().resolve_command(ctx, args)


@click.group(
    cls=_Points,
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

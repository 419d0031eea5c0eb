"""The command ``tables``: a sub-command for each page with generated blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from research.commands import PATH, Command
from research.tables.pages import PAGES, keep_results, outdated_blocks, write_blocks

if TYPE_CHECKING:
    from pathlib import Path


@click.group(
    invoke_without_command=True,
    no_args_is_help=True,
    epilog="""\b
Examples:
  python -m research tables accuracy --learned learned.json --wolves wolves.json
  python -m research tables quality
  python -m research tables --check
""",
)
@click.option("--check", is_flag=True, help="Compare all pages with the results; write nothing.")
@click.pass_context
def command(context: click.Context, check: bool) -> None:
    """Write measured results into the pages of the documentation.

    The results are kept in docs/data; a part that is not given stays as it is. --check ends with
    exit status 1 where a page differs from these results.
    """
    if check:
        outdated = outdated_blocks()
        for line in outdated:
            click.echo(f"{line} differs from the results")
        context.exit(1 if outdated else 0)


def _page_command(name: str) -> click.Command:
    page = PAGES[name]

    def run(**given: Path | None) -> None:
        keep_results(page, {part: path for part, path in given.items() if path is not None})
        write_blocks(page)

    options = [
        click.Option(
            [f"--{part.replace('_', '-')}", part],
            type=PATH,
            metavar="FILE",
            help=f"{measured.help}.",
        )
        for part, measured in page.parts.items()
    ]
    files = sorted({str(path.name) for path, _ in page.blocks})
    return Command(
        name, callback=run, params=list(options), help=f"Write the tables of {', '.join(files)}."
    )


for _name in PAGES:
    command.add_command(_page_command(_name))

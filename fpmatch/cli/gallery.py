"""`fpmatch gallery`: the commands that look after a gallery, each in a module of its own."""

from __future__ import annotations

from typing import Final

import click

from fpmatch.cli.group import LazyGroup

SUMMARIES: Final = {
    "info": "Tell what a gallery holds, in figures.",
    "list": "List the impressions of a gallery, or what could not be enrolled.",
    "check": "Tell which fingers have impressions that do not match each other.",
    "remove": "Remove impressions from a gallery.",
    "export": "Write the templates of a gallery as files.",
}


@click.group(
    cls=LazyGroup,
    summaries=SUMMARIES,
    prefix="gallery_",
    epilog="""\b
Examples:
  fpmatch gallery info prints.db
  fpmatch gallery list prints.db --failures
  fpmatch gallery check prints.db
  fpmatch gallery export postgresql://me@host/prints -o templates
""",
)
def gallery() -> None:
    """Look after a gallery of enrolled prints, which `fpmatch enrol` makes."""

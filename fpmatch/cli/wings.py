"""Wings: folders of the package that the core does not import, with commands of their own.

A wing registers its commands in its file ``commands.json``, which is read without importing the
wing: a title and the summary of each command.
The command NAME is the object NAME, with underscores, in the module ``fpmatch.WING.cli.NAME``.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NamedTuple

import click

WINGS: Final = ("gallery", "server", "lab")
"""A wing may import the core and the wings before it; the laboratory does not import the server."""


class Wing(NamedTuple):
    """What a wing registers: its title in help texts, summaries of commands."""

    title: str
    commands: dict[str, str]


@cache
def registered() -> dict[str, Wing]:
    """Return what each wing registers, of the wings that are installed."""
    files = {wing: Path(__file__).parents[1] / wing / "commands.json" for wing in WINGS}
    texts = {wing: file.read_bytes() for wing, file in files.items() if file.is_file()}
    return {wing: Wing(**json.loads(text)) for wing, text in texts.items()}


def wing_of(command: str) -> str | None:
    """Return the wing that registers a command, if one does."""
    return next((wing for wing, of in registered().items() if command in of.commands), None)


def from_wing(wing: str, module: str, name: str, *, used_by: str) -> Any:
    """Return an object of a wing's `module`, for a command; fail in one line without the wing."""
    try:
        return getattr(import_module(f"fpmatch.{wing}.{module}"), name)
    except ImportError as error:
        if error.name is None or not f"{error.name}.".startswith(f"fpmatch.{wing}."):
            raise
        reason = f"{used_by!r} needs the package fpmatch.{wing}, which cannot be imported"
        raise click.UsageError(reason) from error

"""`fpmatch gallery compact`: a gallery is rewritten without what was removed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.base.printable import json_text, printable
from fpmatch.cli.notes import show
from fpmatch.cli.options import json_option, key_option

if TYPE_CHECKING:
    from fpmatch.gallery.erasure import FreedSpace


@click.command(
    epilog="""\b
Examples:
  fpmatch gallery compact prints.db
  fpmatch gallery compact postgresql://me@host/prints --json

On SQLite the file is rewritten; meanwhile the disk must have room for a second copy, and no other
program may use the gallery: if one holds it for a minute, the command ends. On PostgreSQL its
tables are rewritten by VACUUM FULL, which only their owner may do; the server's write-ahead log and
backups keep what they have.

Exit status: 0 when it is done, 2 when it could not be; the gallery is whole then.
"""
)
@click.argument("gallery")
@key_option
@json_option
def compact(gallery: str, as_json: bool) -> None:
    """Rewrite GALLERY without free space, and delete prepared prints that no longer fit.

    What versions up to 0.2 removed, which did not overwrite it, is erased.
    """
    from fpmatch.gallery.erasure import free_space
    from fpmatch.gallery.gallery import open_gallery

    with open_gallery(gallery) as opened:
        done, name = free_space(opened), opened.name
    show(json_text({"gallery": name, **done.as_dict()}) if as_json else _as_text(name, done))


def _as_text(name: str, done: FreedSpace) -> str:
    rows = [
        ("Database", done.database_before, done.database_after),
        ("Prepared", done.prepared_before, done.prepared_after),
    ]
    lines = (f"  {label:<12}{after} bytes, {before} before" for label, before, after in rows)
    return "\n".join([printable(name), *lines])

"""`fpmatch gallery rewrite`: a gallery is freed of space, or sealed with a key."""

from __future__ import annotations

from dataclasses import asdict

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, show, show_line
from fpmatch.cli.options import json_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.options import key_option
from fpmatch.printable import count, json_text, printable


@click.command(
    cls=Command,
    details="""
On SQLite the file is rewritten; meanwhile the disk must have room for a second copy, and no other
program may use the gallery: if one holds it for a minute, the command ends. On PostgreSQL its
tables are rewritten by VACUUM FULL, which only their owner may do; the server's write-ahead log and
backups keep what they have. What versions up to 0.2 removed, which did not overwrite it, is erased.

With --encrypt, the source of the keys has the new key first, as `fpmatch key --add` puts it,
and the key that the gallery uses. A gallery that is not encrypted is encrypted; nothing of its
plain templates is left in its files. Other programs wait meanwhile. A run that is killed has
changed nothing, or all: start it again.
""",
    epilog="""\b
Examples:
  fpmatch gallery rewrite prints.db
  fpmatch gallery rewrite postgresql://me@host/prints --json
  fpmatch gallery rewrite prints.db --encrypt --key file:keys.txt
  fpmatch gallery rewrite prints.db --decrypt --key file:keys.txt

Exit status: 0 when it is done, 1 when some templates are damaged, which are left as they are, 2
when it could not be done; the gallery is whole then.
""",
)
@click.argument("gallery")
@click.option("--encrypt", is_flag=True, help="Seal all templates with the current key of --key.")
@click.option("--decrypt", is_flag=True, help="Store all templates without encryption.")
@json_option
@key_option
def rewrite(gallery: str, encrypt: bool, decrypt: bool, as_json: bool) -> int:
    """Rewrite GALLERY without free space, or with its templates encrypted or decrypted.

    Without --encrypt and --decrypt, prepared prints that no longer fit are deleted, too.
    """
    if encrypt and decrypt:
        raise click.UsageError("--encrypt and --decrypt exclude each other")
    if encrypt or decrypt:
        return _seal(gallery, decrypt=decrypt, as_json=as_json)
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.tasks.space import free_space

    with open_gallery(gallery) as opened:
        done, name = free_space(opened), opened.name
    sizes = [
        f"  {label.capitalize():<12}{size['after']} bytes, {size['before']} before"
        for label, size in done.items()
    ]
    text = "\n".join([printable(name), *sizes])
    show(json_text({"gallery": name, **done}) if as_json else text)
    return 0


def _seal(gallery: str, *, decrypt: bool, as_json: bool) -> int:
    """Encrypt all templates of a gallery with the current key, or decrypt them."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.tasks.rotation import PLAIN, rotate

    with open_gallery(gallery) as opened, ProgressBars({"rotate": "encrypting"}) as bars:
        done, name = rotate(opened, decrypt=decrypt, progress=bars.show), opened.name
    for number, why in done.damaged.items():
        say_note(f"{name}: entry {number}, left as it is: {why}")
    if as_json:
        damaged = [{"id": number, "reason": why} for number, why in done.damaged.items()]
        show(json_text({"gallery": name, **asdict(done), "damaged": damaged}))
    else:
        state = "not encrypted any more" if done.key == PLAIN else f"encrypted with key {done.key}"
        show_line(f"{name}: {state}; {count(done.sealed, 'template')} rewritten")
    return 1 if done.damaged else 0
